"""What a walking policy is paid, and the commands that it is paid under."""

import jax
import numpy as np
import pytest

from rebody.ranges import Box
from rebody.training.walking.commands import SLOW, CommandDistribution
from rebody.training.walking.reward import WalkingReward, walking_reward
from rebody.training.walking.stride import CLEARANCE, FASTEST_FOOT, Stride, drag

WEIGHTS = WalkingReward()
LIMITS = Box((-1.0, -0.5, -1.2), (1.5, 0.5, 1.2))


def paid(command, speed, *, tilt=0.0, height=1.0, stir=0.0, drag=0.0, fell=False, action=0.0, last_action=0.0):
    number = [np.array([each], np.float32) for each in (tilt, height, stir, drag)]
    stride = Stride(np.array([speed], np.float32), *number, np.array([fell]))
    actions = [np.full((1, 2), each, np.float32) for each in (action, last_action)]
    return float(walking_reward(np.array([command], np.float32), stride, *actions, WEIGHTS)[0])


def test_doing_as_told_is_paid_in_full():
    full = WEIGHTS.relative + WEIGHTS.speed + WEIGHTS.relative_turn + WEIGHTS.turn + WEIGHTS.alive
    for command in ([1.0, 0.0, 0.0], [0.1, -0.2, 0.5], [0.0, 0.0, 0.0]):
        assert paid(command, command) == pytest.approx(full, abs=5e-3)


def test_the_nearer_to_what_is_told_the_more_is_paid():
    errors = np.linspace(0.0, 1.0, 11)
    for command in ([1.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.6]):
        for way in range(3):
            earned = [paid(command, np.asarray(command) - error * np.eye(3)[way]) for error in errors]
            assert (np.diff(earned) <= 1e-6).all()
            assert earned[0] > earned[1] > earned[2]


def test_posture_effort_and_falls_have_their_prices():
    command = [0.5, 0.0, 0.0]
    best = paid(command, command)
    assert best - paid(command, command, fell=True) == pytest.approx(WEIGHTS.fall)
    assert best - paid(command, command, tilt=0.2) == pytest.approx(0.2 * WEIGHTS.tilt, rel=1e-4)
    assert best - paid(command, command, height=0.5) == pytest.approx(0.35 * WEIGHTS.crouch, rel=1e-4)
    assert best - paid(command, command, height=0.9) == pytest.approx(0.0, abs=1e-6)
    assert best - paid(command, command, drag=0.4) == pytest.approx(0.4 * WEIGHTS.drag, rel=1e-4)
    held, changed = (paid(command, command, action=0.5, last_action=last) for last in (0.5, 0.0))
    assert held - changed == pytest.approx(0.25 * WEIGHTS.change, rel=1e-4)


def test_only_who_is_told_nothing_pays_for_moving_its_joints():
    for command, price in (([0.0, 0.0, 0.0], 2.0 * WEIGHTS.stir), ([0.0, 0.0, 0.2], 0.0)):
        lost = paid(command, command) - paid(command, command, stir=2.0)
        assert lost == pytest.approx(price, abs=1e-6)


def test_commands_are_within_limits_and_of_every_kind():
    commands = CommandDistribution(slow_share=0.3, zero_share=0.2, spin_share=0.25)
    drawn = np.asarray(commands.sample(jax.random.key(0), 20_000, LIMITS))
    assert (drawn >= LIMITS.low).all()
    assert (drawn <= LIMITS.high).all()
    np.testing.assert_allclose(np.abs(drawn).max(axis=0), [1.5, 0.5, 1.2], atol=0.05)
    is_still = ~drawn.any(axis=1)
    none_of_three = 0.2 * 0.5 * 0.4
    assert is_still.mean() == pytest.approx(0.2 + 0.8 * 0.75 * none_of_three, abs=0.02)
    share = np.abs(drawn / np.where(drawn > 0, LIMITS.high, LIMITS.low)).max(axis=1)
    assert (share[~is_still] < SLOW).mean() > 0.3
    only_turns = ~drawn[:, :2].any(axis=1) & (drawn[:, 2] != 0)
    assert only_turns.mean() == pytest.approx(0.8 * (0.25 + 0.75 * 0.2 * 0.5 * 0.6), abs=0.02)


def test_low_feet_drag_and_high_ones_do_not():
    before = np.zeros((1, 4, 3))
    now = before + np.array([[[0.02, 0.0, 0.0], [0.0, 0.02, 2.0 * CLEARANCE], [0.0, 0.0, 0.0], [9.0, 0.0, 0.0]]])
    now[0, 0, 2] = CLEARANCE
    expected = 0.25 * (0.5 * 1.0 + 0.0 + 0.0 + FASTEST_FOOT)
    np.testing.assert_allclose(drag(before, now, 0.02), expected)
    np.testing.assert_array_equal(drag(before[:, :0], now[:, :0], 0.02), 0.0)
