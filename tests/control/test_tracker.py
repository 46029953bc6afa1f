"""What a tracker is told and what it is paid for."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.control.command import Command, Motion, absolute, after, relative
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import (
    MARGIN,
    Tracker,
    TrackerReward,
    command_inputs,
    tracker_observation,
    tracker_reward,
)
from rebody.ranges import Box, interval
from rebody.tasks import FamilySet, Quantity, line
from rebody.types import POSE_FIELDS, Subgoal

FAR, FAST = 5.0, 3.0
GOAL, VELOCITY, THIRD = 0, 1, 2
"""Slots."""
REACH = FamilySet(
    (
        line.GOAL.within(interval(-FAR / MARGIN, FAR / MARGIN)),
        line.VELOCITY.within(interval(-FAST / MARGIN, FAST / MARGIN)),
    )
)
CONTROL_DT = 0.05
JOINTS = np.linspace(-1, 1, 4).astype(np.float32)


def observe(slot, value, families=REACH):
    return tracker_observation(JOINTS, command(slot, value), families)[len(JOINTS) :]


def command(slot, value):
    """Of numbers, each a vector of one."""
    value = np.asarray(value, np.float32)
    return Command(np.full(value.shape, slot), value[..., None])


def six(like, **fields):
    """Numbers of `POSE_FIELDS`, zero but for these."""
    zero = np.zeros_like(like, np.float32)
    return np.stack([zero + np.float32(fields.get(name, 0.0)) for name in POSE_FIELDS], axis=-1)


def motion(displacement, turn=0.0, pitch=0.0, pace=None, fell=False, rise=0.0):
    """Along x, and steady ones, unless a pace is given [m/s]."""
    displacement = np.asarray(displacement, np.float32)
    pace = displacement / CONTROL_DT if pace is None else pace
    return Motion(
        six(displacement, x=displacement, pitch=turn, z=rise),
        six(displacement, pitch=pitch),
        six(displacement, x=pace),
        np.full(displacement.shape, fell),
    )


def pay(slot, value, displacement, pitch=0.0, action=0.0, control_dt=CONTROL_DT, pace=None):
    """Reward of each of several displacements [m]."""
    displacement = np.asarray(displacement, np.float32)
    pace = displacement / control_dt if pace is None else pace
    return np.asarray(
        tracker_reward(
            command(slot, np.full_like(displacement, value)),
            motion(displacement, pitch=pitch, pace=pace),
            control_dt,
            np.full((*displacement.shape, 6), action, np.float32),
            REACH,
            TrackerReward(),
        )
    )


def test_joint_state_comes_first_and_unchanged():
    observation = tracker_observation(JOINTS, command(GOAL, 2.0), REACH)
    np.testing.assert_array_equal(observation[: len(JOINTS)], JOINTS)
    assert len(observation) == len(JOINTS) + 6 == len(JOINTS) + command_inputs(REACH)


@pytest.mark.parametrize("slot", [GOAL, VELOCITY])
def test_forward_and_backward_are_mirror_images(slot):
    for value in (0.01, 0.3, 2.0, 40.0):
        ahead, behind = observe(slot, value), observe(slot, -value)
        np.testing.assert_array_equal(ahead[:2], behind[:2])
        np.testing.assert_allclose(ahead[2:], -behind[2:], rtol=1e-6)
        assert np.abs(ahead[2:]).max() > 0


@pytest.mark.parametrize(("slot", "bound"), [(GOAL, FAR), (VELOCITY, FAST)])
def test_commands_beyond_the_trained_range_are_cut_to_it(slot, bound):
    np.testing.assert_array_equal(observe(slot, 100.0), observe(slot, bound))
    np.testing.assert_array_equal(observe(slot, -100.0), observe(slot, -bound))
    assert np.abs(observe(slot, 0.9 * bound) - observe(slot, bound)).max() > 0.05
    tracker = Tracker(Actor(10, 6, SACConfig(hidden=(8,)), jax.random.key(0)), REACH)
    np.testing.assert_array_equal(tracker(JOINTS, command(slot, 100.0)), tracker(JOINTS, command(slot, bound)))


def test_a_command_of_zero_still_says_which_slot():
    assert np.abs(observe(GOAL, 0.0) - observe(VELOCITY, 0.0)).max() == 1.0
    np.testing.assert_array_equal(observe(GOAL, 0.0)[2:], observe(VELOCITY, 0.0)[2:])


def test_centimetres_show():
    assert np.abs(observe(GOAL, 0.02) - observe(GOAL, 0.0)).max() > 0.15


DISPLACEMENTS = np.linspace(-0.3, 0.3, 601)  # m in one control step


@pytest.mark.parametrize("goal", [-0.25, -0.03, 0.0, 0.1])
def test_reward_of_a_goal_peaks_on_it(goal):
    paid = pay(GOAL, goal, DISPLACEMENTS)
    assert DISPLACEMENTS[paid.argmax()] == pytest.approx(goal, abs=1e-6)
    assert paid.max() == pytest.approx(TrackerReward().arrival, abs=1e-5)


@pytest.mark.parametrize("goal", [-20.0, 0.5, 8.0])
def test_coming_nearer_to_a_goal_always_pays(goal):
    nearer = np.sign(goal) * np.linspace(-0.2, 0.2, 41)
    assert (np.diff(pay(GOAL, goal, nearer)) > 0).all()


@pytest.mark.parametrize("control_dt", [0.02, 0.05])
@pytest.mark.parametrize("speed", [-3.0, -0.2, 0.0, 1.5])
def test_reward_of_a_speed_peaks_at_it(speed, control_dt):
    paid = pay(VELOCITY, speed, DISPLACEMENTS, control_dt=control_dt)
    assert DISPLACEMENTS[paid.argmax()] == pytest.approx(speed * control_dt, abs=1e-6)
    assert paid.max() == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("speed", [-3.0, -1.0, -0.1, 0.1, 1.0, 3.0])
def test_standing_still_is_never_the_best_answer_to_a_speed(speed):
    """Even though moving costs energy, and even where only half of the speed is reached."""
    still = pay(VELOCITY, speed, 0.0)
    assert pay(VELOCITY, speed, speed * CONTROL_DT, action=1.0) > still
    assert pay(VELOCITY, speed, 0.5 * speed * CONTROL_DT, action=0.7) > still
    assert pay(VELOCITY, speed, -speed * CONTROL_DT) < still


def test_posture_and_energy_cost_the_same_in_both_slots():
    for slot in (GOAL, VELOCITY):
        best = pay(slot, 0.0, 0.0)
        assert best - pay(slot, 0.0, 0.0, pitch=np.pi) == pytest.approx(2 * TrackerReward().upright)
        assert best - pay(slot, 0.0, 0.0, action=-1.0) == pytest.approx(TrackerReward().energy, rel=1e-4)


def test_a_batch_holds_both_slots():
    both = Command(np.array([GOAL, VELOCITY]), np.array([[0.1], [2.0]], np.float32))
    moved = np.array([0.1, 0.1], np.float32)  # onto the goal; at 2 m/s
    paid = tracker_reward(both, motion(moved), CONTROL_DT, np.zeros((2, 6), np.float32), REACH, TrackerReward())
    np.testing.assert_allclose(paid, [0.5, 0.0], atol=1e-6)


# a goal is a point in the world, a pitch is one in space, and a speed is neither

STANDS = REACH.beside(FamilySet((line.STAND.within(interval(-1.0, 1.0)),)))
STAND = THIRD
SUBGOAL = Subgoal(np.array([GOAL, VELOCITY, STAND]), np.array([[4.0], [1.5], [0.5]], np.float32))


def test_a_goal_comes_nearer_as_the_robot_moves():
    """Trap 2: no constant relative goal to chase for ever."""
    poses = [six(np.zeros(3), x=x, pitch=0.2, y=7.0) for x in (0.0, 3.0, 5.5)]
    seen = [np.asarray(relative(STANDS, SUBGOAL, pose).value)[:, 0] for pose in poses]
    np.testing.assert_allclose(seen, [[4.0, 1.5, 0.3], [1.0, 1.5, 0.3], [-1.5, 1.5, 0.3]], atol=1e-6)


def test_after_a_motion_a_subgoal_is_seen_from_where_the_robot_is_then():
    before, then = six(np.zeros(3), x=1.0, pitch=-0.3), six(np.zeros(3), x=1.07, pitch=-0.19)
    seen = after(STANDS, relative(STANDS, SUBGOAL, before), motion(np.full(3, 0.07), turn=0.11))
    np.testing.assert_allclose(seen.value, relative(STANDS, SUBGOAL, then).value, atol=1e-6)
    np.testing.assert_allclose(absolute(STANDS, seen, then).value, SUBGOAL.value, atol=1e-6)


def test_reward_of_a_pitch_peaks_on_it_however_far_the_robot_lies():
    turns = np.linspace(-0.5, 0.5, 101).astype(np.float32)
    told, action = command(STAND, np.full_like(turns, 0.2)), np.zeros((101, 6), np.float32)
    for pitch in (0.0, 1.0):
        moved = motion(np.zeros_like(turns), turn=turns, pitch=pitch)
        paid = np.asarray(tracker_reward(told, moved, CONTROL_DT, action, STANDS, TrackerReward()))
        assert turns[paid.argmax()] == pytest.approx(0.2, abs=1e-6)
        assert paid.max() == pytest.approx(TrackerReward().arrival, abs=1e-5)


def test_a_third_slot_shows_beside_the_others():
    observation = observe(STAND, 0.3, STANDS)
    np.testing.assert_array_equal(observation[:3], [0, 0, 1])
    np.testing.assert_array_equal(observation[3:7], 0)
    np.testing.assert_allclose(observation[7:], [0.3, np.tanh(0.6), np.tanh(3.0)], rtol=1e-6)


JUMPS = REACH.beside(FamilySet((line.JUMP.within(interval(1.0, 2.0)),)))
JUMP = THIRD


def pay_of_rises(value, vz):
    """Reward of each of several vertical speeds [m/s]."""
    vz = np.asarray(vz, np.float32)
    moved, action = motion(np.zeros_like(vz), rise=vz * CONTROL_DT), np.zeros((len(vz), 6), np.float32)
    return np.asarray(
        tracker_reward(command(JUMP, np.full_like(vz, value)), moved, CONTROL_DT, action, JUMPS, TrackerReward())
    )


@pytest.mark.parametrize("wanted", [1.0, 1.5, 2.0])
def test_one_jump_at_the_wanted_speed_is_paid_more_than_any_other_hopping(wanted):
    """Each jump up and down again, one after the other, for as long as gravity takes."""

    def of_hopping(speed):
        return pay_of_rises(wanted, np.linspace(speed, -speed, 201)).mean()

    speeds = np.linspace(0.1, 3.0, 59)
    assert speeds[np.argmax([of_hopping(speed) for speed in speeds])] == pytest.approx(wanted, rel=0.2)
    assert of_hopping(wanted) > 0.1 > of_hopping(wanted / 2)


def test_told_to_jump_at_zero_a_robot_is_paid_most_for_staying_down():
    paid = pay_of_rises(0.0, [-1.0, 0.0, 0.5, 0.6, 1.0])
    np.testing.assert_array_equal(paid[:3], 0)
    assert paid[4] < paid[3] < 0


def test_a_jump_shows_beside_the_other_slots():
    np.testing.assert_allclose(observe(JUMP, 1.3, JUMPS), [0, 0, 1, 0, 0, 0, 0, 1.3], rtol=1e-6)


WALKS = TrackerReward(relative=2.0, alive=0.5)


def pay_walker(slot, value, speed, fell=False):
    moved = motion(np.array([speed * CONTROL_DT]), fell=fell)
    told, action = command(slot, np.array([value])), np.zeros((1, 6), np.float32)
    return float(tracker_reward(told, moved, CONTROL_DT, action, STANDS, WALKS)[0])


@pytest.mark.parametrize(("slot", "value"), [(VELOCITY, 2.0), (VELOCITY, -0.3), (GOAL, 3.0), (GOAL, -1.0)])
def test_relative_errors_make_it_walk(slot, value):
    """Half of the way to a wanted speed pays, standing does not; a goal is the speed that leads there."""
    wanted = value if slot == VELOCITY else np.clip(1.5 * value, -FAST / MARGIN, FAST / MARGIN)
    still, half, full = (pay_walker(slot, value, share * wanted) for share in (0.0, 0.5, 1.0))
    assert full > half > still
    assert full - still > 0.5


def test_a_fall_costs_what_being_on_its_feet_pays():
    assert pay_walker(VELOCITY, 1.0, 1.0) - pay_walker(VELOCITY, 1.0, 1.0, fell=True) == pytest.approx(0.5)


def test_a_speed_is_paid_by_the_pace_and_not_by_every_step():
    steps = CONTROL_DT * np.array([0.0, 1.0, 2.0], np.float32)
    np.testing.assert_array_equal(np.ptp(pay(VELOCITY, 1.0, steps, pace=1.0)), 0.0)
    assert pay(VELOCITY, 1.0, steps, pace=1.0)[0] > pay(VELOCITY, 1.0, steps, pace=0.8)[0]


# several numbers at once

PLACE = replace(
    line.GOAL, name="place", quantity=Quantity("xy", ("x", "y"), "m", "place"),
    targets=(Box((-5.0, -2.0), (5.0, 2.0)),), directions=(),
)  # fmt: skip
RUN = replace(
    line.VELOCITY, name="run", quantity=Quantity("v", ("vx", "vy"), "m/s", "speed"),
    targets=(Box((-1.0, -0.5), (3.0, 0.5)),), directions=(),
)  # fmt: skip
LEAN = replace(
    line.STAND, name="lean", quantity=Quantity("x_pitch", ("x", "pitch"), "m, rad", "place and pitch"),
    targets=(Box((-4.0, -1.0), (4.0, 1.0)),), directions=(),
)  # fmt: skip
LEAP = replace(
    line.JUMP, name="leap", quantity=Quantity("vxz", ("vx", "vz"), "m/s", "speed of a leap"),
    targets=(Box((0.0, 1.0), (2.0, 2.0)),), directions=(),
)  # fmt: skip
VECTORS = FamilySet((PLACE, RUN, LEAN, LEAP))


def told(slot, *vector):
    return Command(np.full(1, slot), np.array([vector], np.float32))


def paid(slot, vector, weights=None, **moved):
    """Reward of one motion; `velocity` is a mean over the last ones."""
    zero = np.zeros(1)
    step = Motion(*(six(zero, **moved.get(name, {})) for name in ("displacement", "pose", "velocity")), zero > 0)
    action = np.zeros((1, 6), np.float32)
    weights = weights or TrackerReward()
    return float(tracker_reward(told(slot, *vector), step, CONTROL_DT, action, VECTORS, weights)[0])


def test_every_number_of_a_command_shows_in_a_place_of_its_own():
    """On three scales where it is to be brought somewhere, as it is where it is a speed."""
    seen = {slot: observe_vector(slot, 0.5, -0.25) for slot in range(4)}
    far = MARGIN * 5.0, MARGIN * 2.0
    places = [0.5 / far[0], np.tanh(1.0), np.tanh(5.0), -0.25 / far[1], np.tanh(-0.5), np.tanh(-2.5)]
    lean = [0.5 / (MARGIN * 4.0), np.tanh(1.0), np.tanh(5.0), -0.25, np.tanh(-0.5), np.tanh(-2.5)]
    np.testing.assert_allclose(seen[0], [1, 0, 0, 0, *places, *10 * [0]], rtol=1e-6)
    np.testing.assert_allclose(seen[1], [0, 1, 0, 0, *6 * [0], 0.5, -0.25, *8 * [0]], rtol=1e-6)
    np.testing.assert_allclose(seen[2], [0, 0, 1, 0, *8 * [0], *lean, 0, 0], rtol=1e-6)
    np.testing.assert_allclose(seen[3], [0, 0, 0, 1, *14 * [0], 0.5, 0.0], rtol=1e-6)  # no leap downwards
    assert command_inputs(VECTORS) == 20


def observe_vector(slot, *vector):
    return tracker_observation(np.zeros((1, 0), np.float32), told(slot, *vector), VECTORS)[0]


def test_each_number_is_cut_to_its_own_range():
    for slot, far in ((0, (5.5, 2.2)), (1, (3.3, 0.55))):
        np.testing.assert_allclose(observe_vector(slot, 90.0, 90.0), observe_vector(slot, *far), rtol=1e-6)
    np.testing.assert_allclose(observe_vector(1, -90.0, -90.0), observe_vector(1, -1.1, -0.55), rtol=1e-6)


def test_a_place_is_paid_by_its_distance():
    """By formula: arrival in full on it, half at 0.1 m; so much per metre."""
    weights = TrackerReward()
    left = np.hypot(0.3, 0.4)
    moved = {"displacement": {"x": 0.1, "y": -0.1}}
    expected = weights.arrival * 0.1 / (0.1 + left) - weights.distance * left
    assert paid(0, (0.4, 0.3), **moved) == pytest.approx(expected, abs=1e-5)
    assert paid(0, (0.1, -0.1), **moved) == pytest.approx(weights.arrival, abs=1e-4)


def test_a_place_with_an_attitude_is_paid_by_both_prices_and_not_for_being_upright():
    weights = TrackerReward()
    left = np.hypot(0.3, 0.2)
    price = np.hypot(weights.distance * 0.3, weights.turn * 0.2)
    moved = {"displacement": {"x": 0.1, "pitch": 0.1}, "pose": {"pitch": 1.0}}
    assert paid(2, (0.4, 0.3), **moved) == pytest.approx(weights.arrival * 0.1 / (0.1 + left) - price, abs=1e-5)


@pytest.mark.parametrize("pose", [{"pitch": 1.0}, {"roll": 1.0}])
def test_all_else_is_paid_for_being_upright(pose):
    for slot, vector in ((0, (0.4, 0.3)), (1, (0.0, 0.0)), (3, (1.0, 1.0))):
        lost = TrackerReward().upright * (1 - np.cos(1.0))
        assert paid(slot, vector) - paid(slot, vector, pose=pose) == pytest.approx(lost, abs=1e-5)


def test_speeds_are_paid_by_the_length_of_what_is_missed():
    weights = TrackerReward()
    velocity = {"velocity": {"x": 1.0, "y": 0.4}, "displacement": {"x": 9.0}}
    assert paid(1, (1.3, 0.0), **velocity) == pytest.approx(-weights.speed * 0.5, abs=1e-5)
    walks = TrackerReward(relative=2.0)
    assert paid(1, (1.3, 0.0), walks, **velocity) == pytest.approx(2 * (1 - 0.5 / 1.3), abs=1e-5)
    assert paid(1, (0.1, 0.0), walks) == pytest.approx(2 * (1 - 0.1 / 0.5), abs=1e-5)  # relative to 0.5 m/s at least
    assert paid(1, (1.0, 0.0), walks, velocity={"x": -9.0}) == pytest.approx(2 * -0.5, abs=1e-5)


def test_a_far_place_is_the_speed_that_leads_there_within_what_the_robot_can():
    walks = TrackerReward(relative=2.0)
    fast = {"displacement": {"x": 3.0 * CONTROL_DT, "y": -0.5 * CONTROL_DT}}
    left = np.hypot(4.0 - 0.15, 2.0 - 0.025)
    expected = 2.0 + walks.arrival * 0.1 / (0.1 + left)
    assert paid(0, (4.0, -2.0), walks, **fast) == pytest.approx(expected, abs=1e-4)


def test_a_leap_is_paid_by_the_share_along_its_direction():
    """What is across does not count, and beyond it costs."""
    up = {"displacement": {"x": 0.6 * CONTROL_DT, "z": 0.8 * CONTROL_DT}}
    assert paid(3, (1.2, 1.6), **up) == pytest.approx(0.25, abs=1e-5)
    assert paid(3, (0.6, 0.8), **up) == pytest.approx(1.0, abs=1e-5)
    assert paid(3, (0.0, 1.6), **up) == pytest.approx(0.25, abs=1e-5)
    assert paid(3, (0.3, 0.4), **up) == pytest.approx(1.0 - TrackerReward().overshoot, abs=1e-4)


def test_a_batch_holds_vectors_of_all_slots():
    both = Command(np.arange(4), np.array([[0.4, 0.3], [1.3, 0.0], [0.4, 0.3], [1.2, 1.6]], np.float32))
    step = motion(np.full(4, 0.05), pitch=0.3)
    together = tracker_reward(both, step, CONTROL_DT, np.zeros((4, 6), np.float32), VECTORS, TrackerReward())
    moved = {"displacement": {"x": 0.05}, "pose": {"pitch": 0.3}, "velocity": {"x": 1.0}}
    alone = [paid(i, vector, **moved) for i, vector in enumerate(np.asarray(both.value))]
    np.testing.assert_allclose(together, alone, atol=1e-5)
