"""What actions mean to a joystick."""

import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.walking import Joystick
from rebody.bodies.walking.joystick import NAVIGATOR_SEES, REST, navigator_sees
from rebody.ranges import Box
from rebody.types import global_state

STICK = Joystick(Box((-0.5, -0.3, -1.0), (1.5, 0.3, 1.0)), dead=(0.25, 0.0, 0.4), drift=(0.1, 0.0, 0.0))


def test_a_stick_that_is_let_go_commands_nothing():
    for actions in (np.zeros(3), np.full(3, REST), np.full(3, -REST)):
        np.testing.assert_array_equal(STICK.command(actions), np.zeros(3))


def test_full_actions_are_the_limits():
    np.testing.assert_allclose(STICK.command(np.ones(3)), [1.5, 0.3, 1.0], rtol=1e-6)
    np.testing.assert_allclose(STICK.command(-np.ones(3)), [-0.5, -0.3, -1.0], rtol=1e-6)


def test_slow_commands_that_would_be_ignored_are_stepped_over():
    least = STICK.command(np.full(3, REST + 1e-3))
    np.testing.assert_allclose(least, [0.25, 0.0, 0.4], atol=2e-3)
    half = REST + 0.5 * (1 - REST)
    np.testing.assert_allclose(STICK.command(np.full(3, half)), [0.25 + 0.5 * 1.25, 0.15, 0.7], rtol=1e-5)
    rising = STICK.command(np.linspace(-1, 1, 201)[:, None] * np.ones(3))
    assert (np.diff(rising, axis=0) >= 0).all()


def test_numpy_and_jax_agree():
    actions = np.random.default_rng(0).uniform(-1, 1, (50, 3)).astype(np.float32)
    np.testing.assert_allclose(STICK.command(jnp.asarray(actions)), STICK.command(actions), atol=1e-6)


def test_a_way_that_is_closed_stays_closed():
    straight = Joystick(Box((-1.0, 0.0, -1.0), (1.0, 0.0, 1.0)), dead=(0.0, 0.2, 0.0))
    assert straight.command(np.array([0.5, 1.0, 0.5]))[1] == 0
    assert straight.command(np.array([0.5, -1.0, 0.5]))[1] == 0


@pytest.mark.parametrize(("at_once", "share"), [(3.0, 1.0), (1.5, 0.75), (1.0, 0.5)])
def test_ways_that_are_not_followed_at_once_get_less_each(at_once, share):
    narrow = Joystick(Box((-1.0, 0.0, -1.0), (1.0, 0.0, 1.0)), at_once=at_once)
    np.testing.assert_allclose(narrow.command(np.array([1.0, 1.0, -1.0])), [share, 0.0, -share], rtol=1e-6)
    np.testing.assert_allclose(narrow.command(np.array([0.0, 0.0, -1.0])), [0.0, 0.0, -1.0], rtol=1e-6)


def test_a_stick_moves_no_faster_than_its_rate():
    slow = Joystick(STICK.limits, rate=2.0)
    np.testing.assert_allclose(slow.towards(np.zeros(3), np.array([1.0, -0.1, 0.2]), 0.1), [0.2, -0.1, 0.2])
    np.testing.assert_array_equal(STICK.towards(np.zeros(3), np.array([1.0, -0.1, 0.2]), 0.1), [1.0, -0.1, 0.2])


@pytest.mark.parametrize("yaw", [0.0, np.pi / 2, -2.0])
def test_a_navigator_sees_how_a_robot_moves_from_itself(yaw):
    ahead, left = 0.7, -0.2
    state = global_state(
        yaw=np.array(yaw),
        vx=np.array(np.cos(yaw) * ahead - np.sin(yaw) * left),
        vy=np.array(np.sin(yaw) * ahead + np.cos(yaw) * left),
        yaw_rate=np.array(0.4),
    )
    seen = navigator_sees(state, STICK.measured, np)
    assert seen.shape == (NAVIGATOR_SEES,)
    expected = [ahead, left, 0.4, -0.5, -0.3, -1.0, 1.5, 0.3, 1.0, 0.25, 0.0, 0.4, 0.1, 0.0, 0.0, 3.0]
    np.testing.assert_allclose(seen, expected, atol=1e-6)
