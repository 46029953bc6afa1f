"""The figures of an episode by hand."""

import jax
import numpy as np
import pytest
from tests.tasks.conftest import DRIFT, LEAN, PLACE

from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.figures import final_error, final_squared_error, ripple, settled
from rebody.tasks.line import GOAL, JUMP, LINE, STAND, VELOCITY
from rebody.types import GLOBAL_FIELDS, GlobalState, Task

TIMES = 0.1 * np.arange(1, 51)  # s; 5 s


def states(**fields):
    """States [time, episode] of one episode; fields that are not given are 0, but for what x displaces."""
    still = np.zeros_like(next(iter(fields.values())), float)
    if "x" in fields and "vx" not in fields:
        fields["vx"] = np.diff(fields["x"], prepend=0.0) / 0.1
    return GlobalState(**{name: np.asarray(fields.get(name, still), float)[:, None] for name in GLOBAL_FIELDS})


def one(family, target):
    """A set of that family alone, and the task of one episode."""
    return FamilySet((family,)), Task(np.array([0]), np.array([family.admit(target)]))


def error(family, target, **fields):
    """Final error of one episode."""
    return final_error(*one(family, target), states(**fields)).item()


def test_final_error_of_a_goal_is_the_mean_distance_over_the_last_2_s():
    position = np.where(TIMES > 3.05, 4.0, -100.0)
    assert error(GOAL, 4.0, x=position) == pytest.approx(0.0)
    assert error(GOAL, 5.0, x=position) == pytest.approx(1.0)
    position[-1] = 2.0  # 1 of 20 decisions is 2 m off
    position[-2] = 6.0  # and one on the other side: distances do not cancel
    assert error(GOAL, 4.0, x=position) == pytest.approx(0.2)


def test_final_error_of_a_pitch_is_the_mean_distance_over_the_last_2_s():
    pitch = np.where(TIMES > 3.05, 1.0, -3.0)
    assert error(STAND, 1.0, pitch=pitch) == pytest.approx(0.0)
    assert error(STAND, -0.5, pitch=pitch, x=TIMES, vx=TIMES) == pytest.approx(1.5)
    pitch[-2:] = 0.0, 2.0
    assert error(STAND, 1.0, pitch=pitch) == pytest.approx(0.1)


def test_a_pitch_goes_the_shorter_way_round():
    """-3.1 rad is 0.08 rad from 3.1 rad, not 6.2."""
    turned = np.where(TIMES > 3.05, -3.1, 0.0)
    assert error(STAND, 3.1, pitch=turned) == pytest.approx(2 * np.pi - 6.2)
    assert final_squared_error(*one(STAND, 3.1), states(pitch=turned)) == pytest.approx((2 * np.pi - 6.2) ** 2)


def test_final_error_of_a_velocity_is_that_of_its_mean_over_1_s():
    steady = 1.5 * TIMES
    gait = steady + 0.1 * np.sin(2 * np.pi * TIMES / 0.5)  # two periods a second
    for position in (steady, gait, steady + 7.0):
        assert error(VELOCITY, 1.5, x=position) == pytest.approx(0.0, abs=1e-9)
        assert error(VELOCITY, 1.0, x=position) == pytest.approx(0.5)
        assert error(VELOCITY, -1.5, x=position) == pytest.approx(3.0)


def test_final_error_of_a_jump_is_that_of_the_largest_vertical_speed_of_1_s():
    vz = np.where(np.arange(50) % 5 == 0, 2.0, -0.5)  # a jump every half a second, the last one at 4.6 s
    assert error(JUMP, 2.0, vz=vz) == pytest.approx(0.0)
    assert error(JUMP, 1.5, vz=vz, x=TIMES, vx=TIMES) == pytest.approx(0.5)
    vz[40] = vz[45] = -0.5  # one less at 4.1 s, one at 4.6 s: the one at 3.6 s counts until 4.5 s
    assert error(JUMP, 2.0, vz=vz) == pytest.approx(2.5 * 5 / 20)


def test_final_error_of_a_velocity_looks_back_3_s():
    position = np.where(TIMES > 2.05, TIMES, 0.0)  # before x(2.1 s), nothing counts
    position[19:] = TIMES[19:]
    assert error(VELOCITY, 1.0, x=position) == pytest.approx(0.0)
    position[20] += 0.5  # x(2.1 s): the first of 20 velocities is 0.5 m/s too slow
    assert error(VELOCITY, 1.0, x=position) == pytest.approx(0.5 / 20)


def test_an_episode_of_2_s_begins_at_its_start():
    """Before it the body stood still."""
    found = final_error(*one(VELOCITY, 1.0), states(x=TIMES[:20]))
    assert found == pytest.approx(np.mean(1 - np.r_[TIMES[:9], [1] * 11]))


def test_final_squared_error_is_that_of_the_last_decision():
    vx, pitch, vz = np.array([[9.0, 9.0, 0.5], [0.0, 0.0, -1.0], [0.0, 2.0, 1.0]])
    series = states(x=np.array([0.0, 1.0, 3.0]), vx=vx, pitch=pitch, vz=vz)
    for family, target, squared in ((GOAL, 5.0, 4.0), (VELOCITY, 2.0, 2.25), (STAND, 0.5, 2.25), (JUMP, 1.5, 0.25)):
        assert final_squared_error(*one(family, target), series) == pytest.approx(squared)


def test_ripple_is_the_spread_of_the_velocity_about_its_mean():
    velocity = 1.0 + 0.3 * np.sign(np.sin(2 * np.pi * (TIMES - 0.05) / 0.2))  # +-0.3 m/s in turns
    assert ripple(states(x=0.1 * velocity.cumsum(), vx=velocity)) == pytest.approx(0.3)
    assert ripple(states(x=TIMES, vx=np.ones(50))) == pytest.approx(0.0)


def test_final_error_of_a_place_is_the_mean_length_over_the_last_2_s():
    x, y = (np.where(TIMES > 3.05, number, -100.0) for number in (3.0, -4.0))
    assert error(PLACE, (3.0, -4.0), x=x, y=y) == pytest.approx(0.0, abs=1e-5)
    assert error(PLACE, (0.0, 0.0), x=x, y=y) == pytest.approx(5.0)
    y[-1] += 4.0  # 1 of 20 decisions is 4 m off
    assert error(PLACE, (3.0, -4.0), x=x, y=y) == pytest.approx(0.2, abs=1e-5)
    assert final_squared_error(*one(PLACE, (3.0, -4.0)), states(x=x, y=y)) == pytest.approx(16.0)


def test_a_heading_beside_a_place_goes_the_shorter_way_round():
    x, yaw = np.full(50, 2.0), np.where(TIMES > 3.05, -3.1, 0.0)
    assert error(LEAN, (2.0, 3.1), x=x, yaw=yaw) == pytest.approx(2 * np.pi - 6.2, rel=1e-5)
    assert error(LEAN, (5.0, 3.1 - 4.0), x=x, yaw=yaw) == pytest.approx(np.hypot(3.0, 2.2), rel=1e-5)


def test_speeds_of_a_heading_are_those_of_its_mean_over_1_s():
    """One that goes round at 1 m/s always goes ahead, wherever that is."""
    yaw = TIMES % 2.0
    vx, vy = np.cos(yaw), np.sin(yaw)
    assert error(DRIFT, (1.0, 0.0), yaw=yaw, vx=vx, vy=vy) == pytest.approx(0.0, abs=1e-5)
    assert error(DRIFT, (0.0, 0.0), yaw=yaw, vx=vx, vy=vy) == pytest.approx(1.0)
    wiggle = 0.1 * np.sin(2 * np.pi * TIMES / 0.5)  # which a mean over a second does not see
    assert error(DRIFT, (0.5, 0.0), vx=0.5 + wiggle, vy=wiggle) == pytest.approx(0.0, abs=1e-5)


def test_each_number_of_a_vector_is_settled_alone():
    series = np.stack([np.arange(30.0), -np.arange(30.0)], axis=-1)
    np.testing.assert_array_equal(settled(PLACE, series), series)
    np.testing.assert_allclose(settled(DRIFT, series)[-1], [24.5, -24.5])
    np.testing.assert_array_equal(settled(JUMP, series)[-1], [29.0, -20.0])


def test_many_episodes_are_judged_each_by_its_own_task(mixed):
    rng = np.random.default_rng(0)
    walks = GlobalState(**{name: rng.normal(size=(50, 2, 3)).cumsum(axis=0) for name in GLOBAL_FIELDS})
    families = mixed.beside(LINE)
    tasks = Task(np.array([[0, 1, 2], [3, 4, families.index("jump")]]), rng.normal(size=(2, 3, 2)))
    found = final_error(families, tasks, walks), final_squared_error(families, tasks, walks), ripple(walks)
    assert all(figure.shape == (2, 3) for figure in found)
    for i, j in np.ndindex(2, 3):
        alone = jax.tree.map(lambda leaf, i=i, j=j: leaf[..., i, j, None], walks)
        family = families[tasks.family[i, j]]
        told = one(family, tuple(tasks.target[i, j, : family.size]))
        expected = final_error(*told, alone), final_squared_error(*told, alone), ripple(alone)
        assert [figure[i, j] for figure in found] == pytest.approx([figure.item() for figure in expected])


def test_tolerances():
    assert [SHIPPED.named(name).tolerance for name in ("goal", "velocity", "stand")] == [0.25, 0.25, 0.2]
