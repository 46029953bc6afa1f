"""The navigator learns on the joystick toy, and the one that ships does what it is told."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.parts import load_tracker
from rebody.bodies.walking import toy
from rebody.bodies.walking.joystick import Measured
from rebody.control.command import relative
from rebody.training.navigator import NavigatorConfig, train_navigator
from rebody.training.navigator.to_go import error_to_go, time_to_go
from rebody.training.navigator.train import HEADINGS, NAVIGATED, PLACES, VELOCITIES, drive, initial_state, learn
from rebody.types import POSE_FIELDS, Subgoal

TINY = NavigatorConfig(hidden=(32, 32), projections=4, courses=32, updates=20, iterations=2, held_out=20)


def walker(size, *, gain=1.0, lag=0.2, dead=0.0, sideways=0.4, drift=(0.0, 0.0, 0.0), at_once=3.0):
    """Nothing hidden about it but gain and lag."""
    high = jnp.broadcast_to(jnp.asarray([1.0, sideways, 1.0]), (size, 3))
    still = jnp.zeros((size, 3))
    return toy.Walker(
        measured=Measured(
            -high * jnp.asarray([0.6, 1.0, 1.0]),
            high,
            still + dead,
            still + jnp.asarray(drift),
            jnp.full((size, 1), at_once),
        ),
        gain=still + gain,
        lag=still + lag,
        delay=jnp.zeros(size),
        strays=jnp.zeros((size, 2)),
        bias=still,
        ripple=still,
        period=jnp.ones(size),
        phase=still,
    )


def test_a_walker_goes_as_it_is_told():
    """From rest at full stick ahead: 1 - (2/3)^n of the speed, since a third is made up in each decision of 0.1 s."""
    state, robot = toy.begin(jnp.zeros(1), jnp.zeros(1), jnp.full(1, np.pi / 2)), walker(1)
    for n in range(1, 6):
        state = toy.step(state, robot, jnp.asarray([[1.0, 0.0, 0.0]]))
        seen = toy.observe(state)
        np.testing.assert_allclose([seen.vx[0], seen.vy[0]], [0.0, 1 - (2 / 3) ** n], atol=1e-6)
    for _ in range(100):
        state = toy.step(state, robot, jnp.asarray([[0.0, 0.0, 0.0]]))
    np.testing.assert_allclose(toy.observe(state).vy, 0.0, atol=1e-5)


def test_a_drifting_walker_drifts_and_a_weak_one_is_slow():
    robot = walker(1, gain=0.5, drift=(0.1, -0.05, 0.0))
    state = toy.begin(jnp.zeros(1), jnp.zeros(1), jnp.zeros(1))
    for _ in range(100):
        state = toy.step(state, robot, jnp.zeros((1, 3)))
    np.testing.assert_allclose(state.speed[0], [0.1, -0.05, 0.0], atol=1e-5)
    for _ in range(100):
        state = toy.step(state, robot, jnp.asarray([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(state.speed[0], [0.6, -0.05, 0.0], atol=1e-5)


def test_walkers_are_drawn_in_their_ranges():
    drawn = TINY.walkers.sample(jax.random.key(0), 4000)
    known = drawn.measured
    assert (known.low <= 0).all()
    assert (known.high >= 0).all()
    assert (known.dead <= 0.6 * jnp.minimum(known.high, -known.low) + 1e-6).all()
    assert np.mean(known.high[:, 1] == 0) == pytest.approx(0.15, abs=0.03)
    assert np.mean((known.dead == 0).all(axis=1)) == pytest.approx(0.5, abs=0.05)
    assert drawn.delay.min() >= 0
    assert drawn.delay.max() <= 1


def test_a_walker_that_follows_one_way_at_a_time_is_given_less_of_each():
    zero, full = jnp.zeros(1), jnp.asarray([[1.0, 0.0, 1.0]])
    for at_once, share in ((3.0, 1.0), (1.5, 0.75), (1.0, 0.5)):
        state, robot = toy.begin(zero, zero, zero), walker(1, at_once=at_once)
        for _ in range(100):
            state = toy.step(state, robot, full)
        np.testing.assert_allclose(state.speed[0], [share, 0.0, share], atol=1e-4)


def test_turning_first_pays_for_a_far_place_behind_a_slow_walker_alone():
    """Backwards at 0.6 m/s, or half a turn at 1 rad/s and then ahead at 1 m/s."""
    robot = walker(4)
    places = jnp.asarray([(2.0, 0.0), (-0.6, 0.0), (-12.0, 0.0), (0.0, 0.4)])
    np.testing.assert_allclose(time_to_go(robot, places), [2.0, 1.0, np.pi + 12.0, 1.0], rtol=1e-3)


def test_turning_first_pays_for_a_velocity_that_cannot_be_had_as_the_robot_stands():
    """Ahead at 1 m/s, backwards at 0.6; both at once only to half; a turn of a quarter takes pi / 2 s."""
    velocities = jnp.asarray([(0.9, 0.0), (-0.5, 0.0), (0.0, 0.8), (0.5, 0.4)])
    np.testing.assert_allclose(error_to_go(walker(4), velocities), [0.0, 0.0, 0.4 * np.pi, 0.0], atol=2e-3)
    narrow = np.asarray(error_to_go(walker(4, at_once=1.0), velocities))
    np.testing.assert_allclose(narrow[3], np.hypot(0.5, 0.4) * np.arctan2(0.4, 0.5), rtol=1e-2)


@pytest.mark.parametrize(
    ("sideways", "dead", "at_once"), [(0.4, 0.0, 3.0), (0.4, 0.2, 3.0), (0.0, 0.0, 3.0), (0.4, 0.0, 1.0)]
)
def test_the_navigator_that_ships_does_what_it_is_told(sideways, dead, at_once):
    told = Subgoal(
        jnp.asarray([PLACES] * 4 + [VELOCITIES] * 3 + [HEADINGS] * 2),
        jnp.asarray([(2.5, 0), (0, 2), (-2, 0), (0.2, 0.3), (0.6, 0), (0, 0.5), (-0.5, 0), (2.5, 0), (-1, 0)], float),
    )
    tracker, robot = load_tracker("navigator").tracker, walker(9, sideways=sideways, dead=dead, at_once=at_once)
    zero = jnp.zeros(9)
    state, left = toy.begin(zero, zero, zero), []
    step = jax.jit(
        lambda s: toy.step(
            s, robot, tracker(toy.sees(s, robot), relative(NAVIGATED, told, toy.observe(s).select(POSE_FIELDS)))
        )
    )
    for _ in range(150):
        state = step(state)
        seen = toy.observe(state)
        of_each = [f.quantity.distance(f.quantity.read(seen), told.value[:, : f.size]) for f in NAVIGATED]
        left.append(jnp.stack(of_each)[told.slot, jnp.arange(9)])
    ended = np.asarray(left)[-30:].mean(axis=0)
    assert ended[:4].max() < 0.12
    assert ended[4:7].max() < 0.2
    assert ended[7:].max() < 0.06


def test_learning_lowers_what_is_left():
    config = replace(TINY, updates=150)
    state = initial_state(config, jax.random.key(0))
    _, before, _ = drive(state.actor, config, 200, jax.random.key(5))
    actor, _, _ = learn(state, config, jax.random.key(1))
    _, after, _ = drive(actor, config, 200, jax.random.key(5))
    assert float(after.left.mean()) < 0.9 * float(before.left.mean())


def test_the_same_seed_makes_the_same_navigator(tmp_path):
    for name in ("one", "other"):
        train_navigator(TINY, tmp_path / name, 3)
    one, other = (load_tracker(str(tmp_path / name)).tracker for name in ("one", "other"))
    jax.tree.map(np.testing.assert_array_equal, one.actor.net.mlp.weights, other.actor.net.mlp.weights)
    assert one.families == NAVIGATED
    assert "Navigator" in (tmp_path / "one" / "card.md").read_text()
