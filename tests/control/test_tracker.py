"""What a tracker is told and what it is paid for."""

import jax
import numpy as np
import pytest

from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import SLOTS, Command, Tracker, TrackerReward, tracker_observation, tracker_reward
from rebody.tasks import GOAL, VELOCITY, family_names

FAR, FAST = 5.0, 3.0
CONTROL_DT = 0.05
JOINTS = np.linspace(-1, 1, 4).astype(np.float32)


def observe(slot, value):
    return tracker_observation(JOINTS, command(slot, np.asarray(value)), FAR, FAST)[len(JOINTS) :]


def command(slot, value):
    value = np.asarray(value, np.float32)
    return Command(np.full(value.shape, slot), value)


def pay(slot, value, displacement, pitch=0.0, action=0.0, control_dt=CONTROL_DT):
    """Reward of each of several displacements [m]."""
    displacement = np.asarray(displacement, np.float32)
    return np.asarray(
        tracker_reward(
            command(slot, np.full_like(displacement, value)),
            displacement,
            control_dt,
            np.full_like(displacement, pitch),
            np.full((*displacement.shape, 6), action, np.float32),
            TrackerReward(),
        )
    )


def test_slots_are_families():
    assert set(SLOTS) <= set(family_names())
    assert (SLOTS.index("goal"), SLOTS.index("velocity")) == (GOAL, VELOCITY)


def test_joint_state_comes_first_and_unchanged():
    observation = tracker_observation(JOINTS, command(GOAL, 2.0), FAR, FAST)
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
    tracker = Tracker(Actor(10, 6, SACConfig(hidden=(8,)), jax.random.key(0)), FAR, FAST)
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
    paid = tracker_reward(both, moved, CONTROL_DT, 0 * moved, np.zeros((2, 6), np.float32), TrackerReward())
    np.testing.assert_allclose(paid, [0.5, 0.0], atol=1e-6)
