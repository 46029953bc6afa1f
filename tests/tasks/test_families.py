"""Rewards by hand, and what is said of an unknown family."""

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.tasks import GOAL, VELOCITY, family_index, reward
from rebody.types import GlobalState, Task


def reward_of(family, target, x=0.0, vx=0.0, form="plain"):
    zero = np.zeros(())
    state = GlobalState(np.asarray(x), zero, zero, zero, np.asarray(vx), zero, zero, zero)
    return float(reward(Task(np.asarray(family), np.asarray(target)), state, form))


@pytest.mark.parametrize(
    ("family", "target", "state", "plain", "relative"),
    [
        (GOAL, 4.0, {"x": 1.0, "vx": 9.0}, -3.0, -0.75),
        (GOAL, -4.0, {"x": 1.0}, -5.0, -1.25),
        (GOAL, 0.5, {"x": 0.0}, -0.5, -0.5),  # divided by the floor of 1 m
        (GOAL, 0.0, {"x": 2.0}, -2.0, -2.0),
        (VELOCITY, 2.0, {"x": 9.0, "vx": 1.5}, -0.5, -0.25),
        (VELOCITY, -2.0, {"vx": 1.0}, -3.0, -1.5),
        (VELOCITY, 0.2, {"vx": 0.1}, -0.1, -0.2),  # divided by the floor of 0.5 m/s
    ],
)
def test_reward_by_hand(family, target, state, plain, relative):
    assert reward_of(family, target, **state) == pytest.approx(plain)
    assert reward_of(family, target, **state, form="relative") == pytest.approx(relative)


def test_a_batch_holds_different_families():
    two = np.asarray([2.0, 2.0])
    zero = np.zeros(2)
    state = GlobalState(two, zero, zero, zero, zero, zero, zero, zero)
    task = Task(np.asarray([GOAL, VELOCITY]), two)
    np.testing.assert_allclose(reward(task, state, "plain"), [0.0, -2.0])


def test_family_index():
    assert (family_index("goal"), family_index("velocity")) == (GOAL, VELOCITY)
    with pytest.raises(RebodyError, match=r"unknown task family 'velocty'; did you mean 'velocity'\?.*goal"):
        family_index("velocty")
