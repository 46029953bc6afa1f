"""What a tracker is told and what it is paid for."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.bodies.robot import Reach
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import (
    MARGIN,
    Command,
    Motion,
    Tracker,
    TrackerReward,
    after,
    relative,
    slots_of,
    tracker_observation,
    tracker_reward,
)
from rebody.tasks import GOAL, JUMP, STAND, VELOCITY, family_names
from rebody.types import Subgoal

FAR, FAST = 5.0, 3.0
REACH = Reach(speed=(-FAST / MARGIN, FAST / MARGIN), distance=FAR / MARGIN)
CONTROL_DT = 0.05
JOINTS = np.linspace(-1, 1, 4).astype(np.float32)


def observe(slot, value):
    return tracker_observation(JOINTS, command(slot, np.asarray(value)), REACH)[len(JOINTS) :]


def command(slot, value):
    value = np.asarray(value, np.float32)
    return Command(np.full(value.shape, slot), value)


def motion(displacement, turn=0.0, pitch=0.0, pace=None, fell=False):
    """Steady ones, unless a pace is given [m/s]."""
    displacement = np.asarray(displacement, np.float32)
    pace = displacement / CONTROL_DT if pace is None else pace
    turn, pitch, pace = (np.full_like(displacement, value) for value in (turn, pitch, pace))
    return Motion(displacement, turn, pitch, pace, np.full(displacement.shape, fell), np.zeros_like(displacement))


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


def test_slots_are_the_first_families():
    assert slots_of(REACH) == family_names()[:2]
    assert slots_of(replace(REACH, pitch=(-1.0, 1.0))) == family_names()[:3]
    assert slots_of(replace(REACH, jump=(1.0, 2.0))) == ("goal", "velocity", "jump")


def test_joint_state_comes_first_and_unchanged():
    observation = tracker_observation(JOINTS, command(GOAL, 2.0), REACH)
    np.testing.assert_array_equal(observation[: len(JOINTS)], JOINTS)
    assert len(observation) == len(JOINTS) + 6


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
    both = Command(np.array([GOAL, VELOCITY]), np.array([0.1, 2.0], np.float32))
    moved = np.array([0.1, 0.1], np.float32)  # onto the goal; at 2 m/s
    paid = tracker_reward(both, motion(moved), CONTROL_DT, np.zeros((2, 6), np.float32), REACH, TrackerReward())
    np.testing.assert_allclose(paid, [0.5, 0.0], atol=1e-6)


# a goal is a point in the world, a pitch is one in space, and a speed is neither

SUBGOAL = Subgoal(np.array([GOAL, VELOCITY, STAND]), np.array([4.0, 1.5, 0.5], np.float32))


def test_a_goal_comes_nearer_as_the_robot_moves():
    """Trap 2: no constant relative goal to chase for ever."""
    seen = [np.asarray(relative(SUBGOAL, np.full(3, x), np.full(3, 0.2)).value) for x in (0.0, 3.0, 5.5)]
    np.testing.assert_allclose(seen, [[4.0, 1.5, 0.3], [1.0, 1.5, 0.3], [-1.5, 1.5, 0.3]], atol=1e-6)


def test_after_a_motion_a_subgoal_is_seen_from_where_the_robot_is_then():
    x, pitch = np.full(3, 1.0, np.float32), np.full(3, -0.3, np.float32)
    moved = motion(np.full(3, 0.07), turn=0.11)
    seen = after(relative(SUBGOAL, x, pitch), moved)
    np.testing.assert_allclose(seen.value, relative(SUBGOAL, x + 0.07, pitch + 0.11).value, atol=1e-6)


STANDS = replace(REACH, pitch=(-1.0, 1.0))


def test_reward_of_a_pitch_peaks_on_it_however_far_the_robot_lies():
    turns = np.linspace(-0.5, 0.5, 101).astype(np.float32)
    told, action = command(STAND, np.full_like(turns, 0.2)), np.zeros((101, 6), np.float32)
    still = np.zeros_like(turns)
    for pitch in (0.0, 1.0):
        moved = Motion(still, turns, still + pitch, still, still > 0, still)
        paid = np.asarray(tracker_reward(told, moved, CONTROL_DT, action, STANDS, TrackerReward()))
        assert turns[paid.argmax()] == pytest.approx(0.2, abs=1e-6)
        assert paid.max() == pytest.approx(TrackerReward().arrival, abs=1e-5)


def test_a_third_slot_shows_beside_the_others():
    observation = tracker_observation(JOINTS, command(STAND, 0.3), STANDS)[len(JOINTS) :]
    np.testing.assert_array_equal(observation[:3], [0, 0, 1])
    np.testing.assert_array_equal(observation[3:7], 0)
    np.testing.assert_allclose(observation[7:], [0.3, np.tanh(0.6), np.tanh(3.0)], rtol=1e-6)


JUMPS = replace(REACH, jump=(1.0, 2.0))


def pay_of_rises(value, vz):
    """Reward of each of several vertical speeds [m/s]."""
    vz = np.asarray(vz, np.float32)
    still = np.zeros_like(vz)
    moved = Motion(still, still, still, still, still > 0, vz * CONTROL_DT)
    action = np.zeros((len(vz), 6), np.float32)
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
    observation = tracker_observation(JOINTS, command(JUMP, 1.3), JUMPS)[len(JOINTS) :]
    np.testing.assert_allclose(observation, [0, 0, 1, 0, 0, 0, 0, 1.3], rtol=1e-6)


WALKS = TrackerReward(relative=2.0, alive=0.5)


def pay_walker(slot, value, speed, fell=False):
    moved = motion(np.array([speed * CONTROL_DT]), fell=fell)
    told, action = command(slot, np.array([value])), np.zeros((1, 6), np.float32)
    return float(tracker_reward(told, moved, CONTROL_DT, action, STANDS, WALKS)[0])


@pytest.mark.parametrize(("slot", "value"), [(VELOCITY, 2.0), (VELOCITY, -0.3), (GOAL, 3.0), (GOAL, -1.0)])
def test_relative_errors_make_it_walk(slot, value):
    """Half of the way to a wanted speed pays, standing does not; a goal is the speed that leads there."""
    wanted = value if slot == VELOCITY else np.clip(1.5 * value, *STANDS.speed)
    still, half, full = (pay_walker(slot, value, share * wanted) for share in (0.0, 0.5, 1.0))
    assert full > half > still
    assert full - still > 0.5


def test_a_fall_costs_what_being_on_its_feet_pays():
    assert pay_walker(VELOCITY, 1.0, 1.0) - pay_walker(VELOCITY, 1.0, 1.0, fell=True) == pytest.approx(0.5)


def test_a_speed_is_paid_by_the_pace_and_not_by_every_step():
    steps = CONTROL_DT * np.array([0.0, 1.0, 2.0], np.float32)
    np.testing.assert_array_equal(np.ptp(pay(VELOCITY, 1.0, steps, pace=1.0)), 0.0)
    assert pay(VELOCITY, 1.0, steps, pace=1.0)[0] > pay(VELOCITY, 1.0, steps, pace=0.8)[0]
