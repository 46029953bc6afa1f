"""What a tracker is asked to do while it learns."""

import jax
import numpy as np
import pytest

from rebody.bodies.toys import MassDamper
from rebody.control.command import commands_within
from rebody.control.tracker import MARGIN
from rebody.ranges import Box, interval
from rebody.tasks import SHIPPED, Family, FamilySet, Quantity
from rebody.tasks.line import LINE
from rebody.training.tracker.commands import CommandDistribution, ToyGuide, _scripted_action
from rebody.types import Task, global_state

GOAL, VELOCITY, STAND, JUMP = range(4)  # slots
DRAWN = 40_000
ROUGHLY = 0.01  # four standard deviations of a share


def within(**ends):
    """Commands of families between these ends."""
    return commands_within(tuple((name, interval(*both)) for name, both in ends.items()), SHIPPED)


def upright(robots=DRAWN):
    return np.zeros((robots, 6), np.float32)


def pitched(pitch):
    """Poses at these pitches [rad]."""
    pose = upright(len(pitch))
    pose[:, 4] = pitch
    return pose


@pytest.fixture(scope="module")
def drawn():
    """(goals [m], speeds [m/s]) of a distribution that is not the default one."""
    distribution = CommandDistribution(near_share=0.3, zero_share=0.2)
    families = within(goal=(-4.0 / MARGIN, 4.0 / MARGIN), velocity=(-2.0 / MARGIN, 2.0 / MARGIN))
    command = distribution.sample(jax.random.key(0), upright(), families)
    slot, value = np.asarray(command.slot), np.asarray(command.value)[:, 0]
    assert set(slot) == {GOAL, VELOCITY}
    return value[slot == GOAL], value[slot == VELOCITY]


def test_half_of_the_commands_are_goals(drawn):
    goals, _ = drawn
    assert len(goals) / DRAWN == pytest.approx(0.5, abs=ROUGHLY)


@pytest.mark.parametrize(("which", "limit"), [(0, 4.0), (1, 2.0)])
def test_commands_fill_their_limits_evenly_to_both_sides(drawn, which, limit):
    values = drawn[which]
    assert 0.99 * limit < np.abs(values).max() <= limit
    assert np.mean(values > 0) == pytest.approx(0.4, abs=ROUGHLY)
    assert np.mean(values == 0) == pytest.approx(0.2, abs=ROUGHLY)


def test_near_goals_are_as_likely_at_every_scale(drawn):
    goals = np.abs(drawn[0])
    for low in (0.01, 0.1):  # half of the near ones each, and what is near by chance
        share = np.mean((goals > low) & (goals <= 10 * low))
        assert share == pytest.approx(0.8 * (0.3 / 2 + 0.7 * 9 * low / 4.0), abs=ROUGHLY)


def test_a_narrower_range_of_speeds_leaves_the_rest_as_it_is():
    distribution, key = CommandDistribution(), jax.random.key(0)
    families = within(goal=(-4.0, 4.0), velocity=(-1.0, 3.0), jump=(1.0, 2.0))
    full, half = (distribution.sample(key, upright(), families, share) for share in (1.0, 0.5))
    shares = np.where(half.slot == VELOCITY, 0.5, 1.0)[:, None]
    np.testing.assert_allclose(half.value, shares * full.value, rtol=1e-6)


@pytest.mark.parametrize("name", ["goal", "velocity", "stand", "jump"])
def test_a_network_of_one_slot_is_told_nothing_else(name):
    families = within(goal=(-4.0, 4.0), velocity=(-1.0, 3.0), stand=(-0.5, 0.5), jump=(1.0, 2.0))
    command = CommandDistribution(only=name).sample(jax.random.key(0), upright(1000), families)
    assert set(np.asarray(command.slot)) == {families.index(name)}
    assert len(np.unique(command.value)) > 800


def test_speeds_are_uniform(drawn):
    speeds = np.sort(drawn[1][drawn[1] != 0])
    expected = np.linspace(-2.0, 2.0, len(speeds))
    assert np.abs(speeds - expected).max() < 0.05


def robots_at(x, vx):
    x, vx = np.asarray(x, np.float32), np.asarray(vx, np.float32)
    return global_state(x=x, vx=vx)


def test_a_guide_is_the_toy_stepped_as_often_as_it_is_ahead():
    family = np.array([GOAL, GOAL, GOAL, VELOCITY, VELOCITY, GOAL], np.int32)
    target = np.array([8.0, -3.0, 0.5, 2.5, -1.0, 8.0], np.float32)
    task = Task(family, target[:, None])
    horizon = np.array([1, 4, 9, 1, 6, 9], np.int32)
    state = robots_at([0.0, 1.0, 0.4, 2.0, -5.0, 0.0], [0.0, 2.0, -0.5, 0.3, 1.0, 0.0])
    subgoal = ToyGuide(task, horizon).subgoal(LINE, state, 9)
    np.testing.assert_array_equal(subgoal.slot, family)

    toy = MassDamper()
    body, expected = toy.begin(state), np.full(len(family), np.nan)
    for ahead in range(1, 10):
        body = toy.step(body, _scripted_action(toy, body, family == GOAL, target), jax.random.key(0))
        reached = np.where(family == GOAL, body.position[:, 0], body.velocity[:, 0])
        expected = np.where(horizon == ahead, reached, expected)
    np.testing.assert_allclose(subgoal.value[:, 0], expected, rtol=1e-5, atol=1e-6)


def test_a_guide_one_decision_ahead_is_nearby():
    """As the subgoals of `reuse` at a horizon of 1: from rest, no farther than the toy accelerates in 0.1 s."""
    guide = ToyGuide(Task(np.array([GOAL]), np.array([[8.0]])), np.array([1]))
    subgoal = guide.subgoal(LINE, robots_at([0.0], [0.0]), 15)
    np.testing.assert_allclose(subgoal.value, 0.1 * 0.1 * 7.0, rtol=1e-5)


@pytest.mark.parametrize(
    ("family", "target", "within"),  # at a goal it switches between full forces
    [(GOAL, 8.0, 0.25), (GOAL, -0.3, 0.25), (VELOCITY, 3.0, 1e-3), (VELOCITY, -1.0, 1e-3)],
)
def test_the_scripted_toy_arrives(family, target, within):
    guide = ToyGuide(Task(np.array([family]), np.array([[target]], np.float32)), np.array([60]))
    np.testing.assert_allclose(guide.subgoal(LINE, robots_at([0.0], [1.0]), 60).value, target, atol=within)


LOPSIDED = within(goal=(-4.0, 4.0), velocity=(-1.0, 3.0), stand=(-0.5, 1.5))


@pytest.fixture(scope="module")
def lopsided():
    """(pitch of each robot, command) of a robot that can do more one way than the other."""
    pitch = np.linspace(-2.0, 2.0, DRAWN).astype(np.float32)
    return pitch, CommandDistribution(zero_share=0.2).sample(jax.random.key(0), pitched(pitch), LOPSIDED)


@pytest.mark.parametrize(("slot", "ends"), [(VELOCITY, (-1.0, 3.0)), (STAND, (-0.5, 1.5))])
def test_a_lopsided_range_is_filled_evenly_from_end_to_end(lopsided, slot, ends):
    pitch, command = lopsided
    asked = unwrapped(pitch, command)[slot][command.slot == slot]
    still = np.abs(asked) < 1e-6
    assert np.mean(still) == pytest.approx(0.2, abs=2 * ROUGHLY)
    expected = np.linspace(MARGIN * ends[0], MARGIN * ends[1], np.sum(~still))
    assert np.abs(np.sort(asked[~still]) - expected).max() < 0.05


def unwrapped(pitch, command):
    """By slot: what is asked for in the world; a robot turns the shorter way."""
    value = np.asarray(command.value[:, 0])
    return {VELOCITY: value, STAND: (value + pitch + np.pi) % (2 * np.pi) - np.pi}


def test_a_robot_that_stands_is_asked_to_in_a_third_of_its_commands(lopsided):
    _, command = lopsided
    for slot in (GOAL, VELOCITY, STAND):
        assert np.mean(command.slot == slot) == pytest.approx(1 / 3, abs=ROUGHLY)


def test_jumps_are_asked_for_within_reach_and_a_little_beyond():
    families = within(goal=(-5.0, 5.0), velocity=(-1.0, 3.0), jump=(1.0, 2.0))
    command = CommandDistribution(zero_share=0.2).sample(jax.random.key(0), upright(), families)
    asked = np.asarray(command.value)[np.asarray(command.slot) == families.index("jump"), 0]
    assert len(asked) / DRAWN == pytest.approx(1 / 3, abs=ROUGHLY)
    assert np.mean(asked == 0) == pytest.approx(0.2, abs=2 * ROUGHLY)
    assert (asked[asked != 0].min(), asked.max()) == pytest.approx((1.0 / MARGIN, 2.0 * MARGIN), abs=0.01)


def test_a_wanted_pitch_does_not_depend_on_the_robots_own(lopsided):
    pitch, command = lopsided
    stands = np.asarray(command.slot) == STAND
    assert abs(np.corrcoef(pitch[stands], unwrapped(pitch, command)[STAND][stands])[0, 1]) < 0.05
    assert np.corrcoef(pitch[stands], command.value[stands, 0])[0, 1] < -0.5


PLACE = Family(
    name="place",
    quantity=Quantity("position", ("x", "y"), "m", "position"),
    targets=(Box((-4.0, -2.0), (4.0, 2.0)),),
    floor=1.0,
    tolerance=0.25,
)
HEADING = Family(
    name="heading",
    quantity=Quantity("yaw", ("yaw",), "rad", "heading"),
    targets=(interval(-3.0, 3.0),),
    floor=0.3,
    tolerance=0.2,
)


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_places_in_the_plane_are_asked_for_on_all_sides(yaw):
    """From where the robot is, however it is turned; near ones as often at every scale, far ones from a box."""
    pose = upright()
    pose[:, :2], pose[:, 5] = (50.0, -7.0), yaw
    families = FamilySet((SHIPPED.named("velocity"), PLACE))
    command = CommandDistribution(near_share=0.4, zero_share=0.0).sample(jax.random.key(0), pose, families)
    ahead = np.asarray(command.value)[np.asarray(command.slot) == 1]
    assert np.abs(ahead).max(axis=0) == pytest.approx((4.0 * MARGIN, 2.0 * MARGIN), rel=0.01)
    np.testing.assert_allclose(ahead.mean(axis=0), 0.0, atol=0.05)
    distance = np.hypot(*ahead.T)
    for low in (0.01, 0.1):
        by_chance = 0.6 * np.pi * (100 - 1) * low**2 / (4 * 4.4 * 2.2)
        share = np.mean((distance > low) & (distance <= 10 * low))
        assert share == pytest.approx(0.2 + by_chance, abs=ROUGHLY)
    near = ahead[distance < 0.1]
    np.testing.assert_allclose(np.abs(near).sum(axis=0) / np.abs(near).sum(), 0.5, atol=0.03)


def test_headings_are_asked_for_from_how_the_robot_is_turned():
    pose = upright()
    pose[:, 5] = 3.0
    command = CommandDistribution(zero_share=0.0).sample(jax.random.key(0), pose, FamilySet((HEADING,)))
    turn = np.asarray(command.value)[:, 0]
    assert np.abs(turn).max() <= np.pi + 1e-6
    assert np.mean(turn > 0) == pytest.approx(0.5, abs=ROUGHLY)
