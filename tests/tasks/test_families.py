"""Rewards by hand, and what is said of an unknown family."""

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.tasks import GOAL, JUMP, STAND, VELOCITY, achieved_by_way_of, base_task, family_index, reward
from rebody.types import GLOBAL_FIELDS, GlobalState, Task, global_state


def reward_of(family, target, x=0.0, vx=0.0, pitch=0.0, form="plain"):
    state = global_state(x=np.asarray(x), pitch=np.asarray(pitch), vx=np.asarray(vx))
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
        (STAND, 1.5, {"x": 9.0, "vx": 9.0, "pitch": 0.5}, -1.0, -2 / 3),
        (STAND, -0.5, {"pitch": 1.0}, -1.5, -3.0),
        (STAND, 0.1, {"pitch": 0.4}, -0.3, -1.0),  # divided by the floor of 0.3 rad
        (STAND, 3.1, {"pitch": -3.1}, 6.2 - 2 * np.pi, (6.2 - 2 * np.pi) / 3.1),  # the shorter way round
    ],
)
def test_reward_by_hand(family, target, state, plain, relative):
    assert reward_of(family, target, **state) == pytest.approx(plain, abs=1e-6)
    assert reward_of(family, target, **state, form="relative") == pytest.approx(relative, abs=1e-6)


def test_a_batch_holds_different_families():
    two = np.full(3, 2.0)
    state = global_state(x=two, pitch=two / 2)
    task = Task(np.asarray([GOAL, VELOCITY, STAND]), two)
    np.testing.assert_allclose(reward(task, state, "plain"), [0.0, -2.0, -1.0])


def test_a_jump_is_the_fastest_rise_on_the_way_all_else_the_last_state():
    series = np.array([[1.0, 5.0], [3.0, 9.0], [2.0, 7.0]], np.float32)  # [time, body]
    states = GlobalState(**dict.fromkeys(GLOBAL_FIELDS, series))
    np.testing.assert_array_equal(achieved_by_way_of(np.array([GOAL, JUMP]), states), [2.0, 9.0])


def test_front_and_back_of_each_family_are_base_tasks():
    families, signs = np.repeat([GOAL, VELOCITY, STAND], 2), np.tile([-1.0, 1.0], 3)
    np.testing.assert_array_equal(base_task(Task(families, 0.01 * signs)), [0, 1, 2, 3, 4, 5])
    np.testing.assert_array_equal(base_task(Task(families, 100 * signs)), [0, 1, 2, 3, 4, 5])


def test_family_index():
    assert [family_index(name) for name in ("goal", "velocity", "stand")] == [GOAL, VELOCITY, STAND]
    with pytest.raises(RebodyError, match=r"unknown task family 'velocty'\. Did you mean 'velocity'\?.*goal"):
        family_index("velocty")
