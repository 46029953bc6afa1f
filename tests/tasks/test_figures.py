"""The figures of an episode by hand."""

import numpy as np
import pytest

from rebody.tasks import FAMILIES
from rebody.tasks.figures import final_error, final_squared_error, ripple, tolerance

TIMES = 0.1 * np.arange(1, 51)  # s; 5 s


def test_final_error_of_a_goal_is_the_mean_distance_over_the_last_2_s():
    position = np.where(TIMES > 3.05, 4.0, -100.0)
    assert final_error("goal", 4.0, position) == pytest.approx(0.0)
    assert final_error("goal", 5.0, position) == pytest.approx(1.0)
    position[-1] = 2.0  # 1 of 20 decisions is 2 m off
    position[-2] = 6.0  # and one on the other side: distances do not cancel
    assert final_error("goal", 4.0, position) == pytest.approx(0.2)


def test_final_error_of_a_velocity_is_that_of_its_mean_over_1_s():
    steady = 1.5 * TIMES
    gait = steady + 0.1 * np.sin(2 * np.pi * TIMES / 0.5)  # two periods a second
    for position in (steady, gait, steady + 7.0):
        assert final_error("velocity", 1.5, position) == pytest.approx(0.0, abs=1e-9)
        assert final_error("velocity", 1.0, position) == pytest.approx(0.5)
        assert final_error("velocity", -1.5, position) == pytest.approx(3.0)


def test_final_error_of_a_velocity_looks_back_3_s():
    position = np.where(TIMES > 2.05, TIMES, 0.0)  # before x(2.1 s), nothing counts
    position[19:] = TIMES[19:]
    assert final_error("velocity", 1.0, position) == pytest.approx(0.0)
    position[20] += 0.5  # x(2.1 s): the first of 20 velocities is 0.5 m/s too slow
    assert final_error("velocity", 1.0, position) == pytest.approx(0.5 / 20)


def test_an_episode_of_2_s_begins_at_its_start():
    """The first mean velocities are displacements from the start."""
    assert final_error("velocity", 1.0, 3.0 + TIMES[:20], start=3.0) == pytest.approx(
        np.mean(1 - np.r_[TIMES[:9], [1] * 11])
    )


def test_final_squared_error_is_that_of_the_last_decision():
    position, velocity = np.array([0.0, 1.0, 3.0]), np.array([9.0, 9.0, 0.5])
    assert final_squared_error("goal", 5.0, position, velocity) == 4.0
    assert final_squared_error("velocity", 2.0, position, velocity) == 2.25


def test_ripple_is_the_spread_of_the_velocity_about_its_mean():
    velocity = 1.0 + 0.3 * np.sign(np.sin(2 * np.pi * (TIMES - 0.05) / 0.2))  # +-0.3 m/s in turns
    position = 0.1 * velocity.cumsum()
    assert ripple(position, velocity) == pytest.approx(0.3)
    assert ripple(TIMES, np.ones(50)) == pytest.approx(0.0)


def test_tolerances():
    assert (tolerance("goal"), tolerance("velocity")) == (0.25, 0.25)
    assert [tolerance(family.name) for family in FAMILIES] == [family.tolerance for family in FAMILIES]
