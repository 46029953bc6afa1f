"""How many control steps an action stands for, and what the choice is paid."""

import numpy as np
import pytest

from rebody.control.command import Command
from rebody.control.step_predictor import is_predictable, step_reward, steps_of
from rebody.tasks.line import LINE

GOAL, VELOCITY = 0, 1
"""Slots of the tiny tracker."""
JOINTS = np.linspace(-1, 1, 3 * 17, dtype=np.float32).reshape(3, 17)


def command(*values, slot=GOAL):
    return Command(np.full(len(values), slot), np.array(values, np.float32)[:, None])


def test_every_number_of_steps_has_an_equal_share_of_the_actions():
    actions = np.linspace(-1, 1, 20_001, dtype=np.float32)[:, None]
    steps, counts = np.unique(steps_of(actions), return_counts=True)
    np.testing.assert_array_equal(steps, np.arange(1, 21))
    assert np.ptp(counts) <= 2
    assert (np.diff(steps_of(actions)) >= 0).all()
    np.testing.assert_array_equal(steps_of(np.array([[-1.0], [1.0], [0.0]])), [1, 20, 10])


@pytest.mark.parametrize(
    ("asked", "error", "steps", "paid"),
    [
        (0.2, 0.0, 1, -0.1),
        (-0.2, 0.1, 4, -0.9),  # half of it left
        (0.2, -0.1, 4, -0.9),  # half of it too far
        (3.0, 0.3, 2, -0.3),
        (0.0, 0.01, 1, -0.3),  # relative to 5 cm at least
        (0.01, 0.01, 1, -0.3),
        (0.1, 0.5, 1, -2.0),  # no worse than that
        (0.1, 0.1, 20, -2.0),
    ],
)
@pytest.mark.parametrize("slot", [GOAL, VELOCITY])
def test_the_reward_is_that_of_the_thesis(asked, error, steps, paid, slot):
    reward = step_reward(command(asked, slot=slot), np.array([[error]], np.float32), np.array([steps]))
    np.testing.assert_allclose(reward, [paid], atol=1e-6)


def test_errors_of_vectors_are_relative_lengths():
    told = Command(np.zeros(1, int), np.array([[0.6, -0.8]], np.float32))
    reward = step_reward(told, np.array([[0.3, 0.4]], np.float32), np.array([2]))
    np.testing.assert_allclose(reward, [-0.5 - 0.2], atol=1e-5)


def test_it_knows_positions_and_speeds_along_x():
    assert [family.name for family in LINE if is_predictable(family)] == ["goal", "velocity"]


def test_it_sees_the_joints_and_the_command(step_predictor):
    near, far = step_predictor(JOINTS, command(0.1, 0.1, 0.1)), step_predictor(JOINTS, command(-0.2, -0.2, -0.2))
    fast = step_predictor(JOINTS, command(3.0, 3.0, 3.0, slot=VELOCITY))
    others = step_predictor(JOINTS[::-1], command(0.1, 0.1, 0.1))
    for steps in (near, far, fast, others):
        assert ((steps >= 1) & (steps <= 20)).all()
        assert np.issubdtype(steps.dtype, np.integer)
    assert len({tuple(np.asarray(steps).tolist()) for steps in (near, far, fast, others)}) == 4


@pytest.mark.parametrize("steps", [1, 4, 20])
def test_a_predictor_can_say_any_number(always, steps):
    np.testing.assert_array_equal(always(steps)(JOINTS, command(0.1, -0.3, 0.0)), [steps] * 3)
