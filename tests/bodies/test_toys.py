"""The toys' arithmetic, and that each disturbance does what it says and nothing when it is off."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.toys import (
    MassDamper,
    PositionToy,
    Randomisation,
    describe_toy,
    make_toy,
    no_disturbance,
)
from rebody.errors import RebodyError
from rebody.types import DECISION_DT, GlobalState

TOYS = [MassDamper(), PositionToy()]
step = eqx.filter_jit(lambda toy, state, action, key: toy.step(state, action, key))


def roll(toy, actions, **disturbance):
    """States after each action of one toy that starts at rest; fields of its disturbance by name."""
    fields = tuple(disturbance)
    values = tuple(jnp.asarray(value, jnp.float32) for value in disturbance.values())
    nominal = no_disturbance(())
    state = toy.initial(
        jnp.zeros(()),
        jnp.zeros(()),
        eqx.tree_at(lambda d: tuple(getattr(d, field) for field in fields), nominal, values) if fields else nominal,
    )
    states = []
    for key, action in zip(jax.random.split(jax.random.key(0), len(actions)), actions, strict=True):
        state = step(toy, state, jnp.full(1, action, jnp.float32), key)
        states.append(state)
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states)


def random_actions(steps=50):
    return np.random.default_rng(0).uniform(-1, 1, steps)


def test_terminal_speed_is_force_over_damping():
    assert roll(MassDamper(), [1.0] * 60).vx[-1] == pytest.approx(3.5, abs=1e-4)
    assert roll(MassDamper(), [-1.0] * 60).vx[-1] == pytest.approx(-3.5, abs=1e-4)


def test_mass_damper_by_hand():
    # v1 = 0.1 * 7 / 1 = 0.7; v2 = 0.7 + 0.1 * (7 - 2 * 0.7) = 1.26
    states = roll(MassDamper(), [1.0, 1.0])
    np.testing.assert_allclose(states.vx, [0.7, 1.26], rtol=1e-6)
    np.testing.assert_allclose(states.x, [0.07, 0.196], rtol=1e-6)


def test_position_toy_by_hand():
    np.testing.assert_allclose(roll(PositionToy(), [1.0, -0.5, 9.0]).x, [0.1, 0.05, 0.15], rtol=1e-6)


@pytest.mark.parametrize("toy", TOYS)
@pytest.mark.parametrize("ripple", [0.0, 0.5])
def test_velocity_is_displacement_over_time(toy, ripple):
    states = roll(toy, random_actions(), ripple_amplitude=ripple, ripple_period=0.37, ripple_phase=1.0)
    displacement = np.diff(states.x, prepend=0.0)
    np.testing.assert_allclose(displacement / DECISION_DT, states.vx, atol=2e-5)


def test_ripple_is_a_sine_on_the_velocity():
    actions = random_actions()
    plain, rippled = (
        roll(MassDamper(), actions, ripple_amplitude=a, ripple_period=0.5, ripple_phase=0.3) for a in (0, 0.4)
    )
    times = DECISION_DT * np.arange(1, len(actions) + 1)
    wave = 0.4 * np.sin(2 * np.pi * times / 0.5 + 0.3)
    np.testing.assert_allclose(rippled.vx - plain.vx, wave, atol=1e-4)
    np.testing.assert_array_equal(rippled.drift, plain.drift)


def test_lag_is_a_first_order_delay_of_the_force():
    # share of the difference made up in each step: dt / (dt + lag) = 1/4
    force = roll(MassDamper(), [1.0] * 3, lag=0.3).force
    np.testing.assert_allclose(force, 7 * (1 - 0.75 ** np.arange(1, 4)), rtol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_gain_weakens_the_action(toy):
    actions = random_actions()
    weak, half = roll(toy, actions, gain=0.5), roll(toy, 0.5 * actions)
    np.testing.assert_allclose(weak.x, half.x, atol=1e-5)


@pytest.mark.parametrize("toy", TOYS)
def test_noise_has_its_standard_deviation(toy):
    states = toy.initial(
        jnp.zeros(20_000),
        jnp.zeros(20_000),
        eqx.tree_at(lambda d: d.state_noise, no_disturbance((20_000,)), jnp.full(20_000, 0.2)),
    )
    after = step(toy, states, jnp.zeros((20_000, 1)), jax.random.key(1))
    noise_of_x = np.asarray(after.x - DECISION_DT * after.vx)
    assert noise_of_x.mean() == pytest.approx(0.0, abs=0.01)
    assert noise_of_x.std() == pytest.approx(0.2, rel=0.03)
    assert np.asarray(after.drift).std() == pytest.approx(0.2 if isinstance(toy, MassDamper) else 0, rel=0.03)


@pytest.mark.parametrize("toy", TOYS)
def test_a_nominal_toy_does_not_depend_on_the_key(toy):
    state, action = toy.initial(jnp.ones(3), jnp.ones(3)), jnp.ones((3, 1))
    one, other = (step(toy, state, action, jax.random.key(seed)) for seed in (0, 1))
    np.testing.assert_array_equal(one.x, other.x)
    np.testing.assert_array_equal(one.vx, one.drift)


def test_randomisation_stays_in_its_ranges():
    drawn = Randomisation(state_noise=0.04).sample(jax.random.key(0), (1000,))
    for values, low, high in [
        (drawn.ripple_amplitude, 0.0, 0.6),
        (drawn.ripple_period, 0.2, 0.8),
        (drawn.lag, 0.0, 0.5),
        (drawn.gain, 0.5, 1.0),
    ]:
        assert low <= values.min() < low + 0.05 * (high - low)
        assert high >= values.max() > high - 0.05 * (high - low)
    np.testing.assert_allclose(drawn.state_noise, 0.2, rtol=1e-6)


@pytest.mark.parametrize("toy", TOYS)
@pytest.mark.parametrize("shape", [(), (3,), (2, 3)])
def test_any_batch_shape(toy, shape):
    state = toy.initial(jnp.zeros(shape), jnp.zeros(shape), Randomisation().sample(jax.random.key(0), shape))
    after = step(toy, state, jnp.ones((*shape, 1)), jax.random.key(0))
    observed = toy.observe(after)
    assert isinstance(observed, GlobalState)
    assert all(leaf.shape == shape for leaf in jax.tree.leaves(observed))


def test_from_global_takes_the_place_of_any_body():
    state = MassDamper().initial(jnp.asarray([2.0]), jnp.asarray([-1.0]))
    again = MassDamper().from_global(MassDamper().observe(state))
    np.testing.assert_array_equal(again.x, [2.0])
    np.testing.assert_array_equal(again.drift, [-1.0])


@pytest.mark.parametrize(
    ("toy", "described"),
    [
        (MassDamper(), {"kind": "mass-damper", "mass": 1.0, "damping": 2.0, "max_force": 7.0}),
        (MassDamper(mass=2.0), {"kind": "mass-damper", "mass": 2.0, "damping": 2.0, "max_force": 7.0}),
        (PositionToy(0.3), {"kind": "position", "max_step": 0.3}),
    ],
)
def test_a_toy_is_made_again_from_its_description(toy, described):
    assert describe_toy(toy) == described
    assert make_toy(**described) == toy


def test_toys_have_names():
    assert make_toy("position") == PositionToy()
    with pytest.raises(RebodyError, match=r"unknown toy 'spring'\. Toys are: mass-damper, position"):
        make_toy("spring")
