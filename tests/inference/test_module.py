"""The loss against closed forms, that it can be learned, and what shapes the latent."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
import pytest

from rebody.inference import InferenceConfig, InferenceModule
from rebody.inference.decoder import Decoder
from rebody.inference.module import Evidence, loss
from rebody.inference.prior import unit_gaussian
from rebody.types import Belief, GlobalState, Transition

CONFIG = InferenceConfig(window=6, units=32, batch_size=16, decoded=4)
UPDATES = 200


def states(x):
    still = np.zeros_like(x)
    return GlobalState(x, still, still, still, still, still, still, still)


@pytest.fixture(scope="module")
def evidence():
    """Random walks around 2 m with a hidden goal at -5 or 5 m each: the rewards tell which."""
    rng = np.random.default_rng(0)
    goal = np.where(np.arange(CONFIG.batch_size) % 2, 5.0, -5.0)[:, None].astype(np.float32)
    x = (
        2 + 0.5 * rng.normal(size=goal.shape) + 0.2 * rng.normal(size=(len(goal), CONFIG.window + 1)).cumsum(1)
    ).astype("f4")
    before = rng.uniform(-6, 6, (len(goal), CONFIG.decoded)).astype(np.float32)
    action = rng.uniform(-1, 1, (*before.shape, 1)).astype(np.float32)
    after = before + 0.1 * action[..., 0]
    return Evidence(
        window=Transition(states(x[:, :-1]), -np.abs(x[:, 1:] - goal), states(x[:, 1:])),
        previous=states(before),
        action=action,
        reward=-np.abs(after - goal),
        state=states(after),
    )


@pytest.fixture(scope="module")
def untrained():
    return eqx.filter_jit(InferenceModule)(CONFIG, 1, jax.random.key(0))


@pytest.fixture(scope="module")
def measured(evidence):
    """A compiled function of a module and its evidence."""
    return eqx.filter_jit(lambda module, evidence: loss(module, evidence, unit_gaussian, CONFIG, jax.random.key(1)))


@pytest.fixture(scope="module")
def trained(untrained, evidence):
    """The module after some updates on the same evidence."""
    optimiser = optax.adam(5e-3)
    arrays, static = eqx.partition(untrained, eqx.is_array)

    def update(carry, key):
        arrays, state = carry
        gradient = jax.grad(lambda a: loss(eqx.combine(a, static), evidence, unit_gaussian, CONFIG, key)[0])(arrays)
        updates, state = optimiser.update(gradient, state)
        return (eqx.apply_updates(arrays, updates), state), None

    @jax.jit
    def run(arrays):
        keys = jax.random.split(jax.random.key(2), UPDATES)
        return jax.lax.scan(update, (arrays, optimiser.init(arrays)), keys)[0][0]

    return eqx.combine(run(arrays), static)


def test_kl_to_the_unit_gaussian_in_closed_form():
    belief = Belief(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 0.0]]), np.array([[1.0, 1.0], [1.0, 1.0], [np.e, 1.0]]))
    np.testing.assert_allclose(unit_gaussian(belief), [0.0, 4.5, 0.5 * (np.e - 2)], rtol=1e-6)


def test_kl_to_the_unit_gaussian_by_monte_carlo():
    belief = Belief(np.array([0.8, -1.5]), np.array([0.3, 2.0]))
    z = belief.mean + np.sqrt(belief.variance) * np.random.default_rng(0).normal(size=(200_000, 2))
    log_q = -0.5 * ((z - belief.mean) ** 2 / belief.variance + np.log(belief.variance)).sum(axis=-1)
    log_p = -0.5 * (z**2).sum(axis=-1)
    assert float(unit_gaussian(belief)) == pytest.approx((log_q - log_p).mean(), rel=0.01)


def test_the_prior_enters_the_loss_by_its_weight(untrained, evidence):
    config = replace(CONFIG, kl_weight=0.3)

    @eqx.filter_jit
    def compare(module):
        key = jax.random.key(1)
        with_prior, metrics = loss(module, evidence, unit_gaussian, config, key)
        without, _ = loss(module, evidence, lambda belief: jnp.zeros(belief.mean.shape[:-1]), config, key)
        return with_prior, without, metrics, unit_gaussian(module.encoder.along(evidence.window)).mean()

    with_prior, without, metrics, expected = compare(untrained)
    assert float(metrics["kl"]) == pytest.approx(float(expected), rel=1e-5)
    assert float(with_prior - without) == pytest.approx(0.3 * float(expected), rel=1e-4)


def test_training_lowers_loss_and_errors(untrained, trained, measured, evidence):
    before, errors_before = measured(untrained, evidence)
    after, errors_after = measured(trained, evidence)
    assert after < before - 0.1
    assert errors_after["reward_error"] < 0.5 * errors_before["reward_error"]
    assert errors_after["state_error"] < 0.5 * errors_before["state_error"]


def test_what_is_learned_is_the_task_of_the_window(trained, measured, evidence):
    """Told of the other goal's window, the decoder predicts the other goal's rewards."""
    other = eqx.tree_at(lambda e: e.window, evidence, jax.tree.map(lambda leaf: np.roll(leaf, 1, 0), evidence.window))
    right, wrong = (measured(trained, e)[1]["reward_error"] for e in (evidence, other))
    assert wrong > 3 * right


@pytest.fixture(scope="module")
def decoder():
    return eqx.filter_jit(Decoder)(2, 1, 3, 8, key=jax.random.key(0))


def test_dynamics_do_not_shape_the_latent_and_rewards_do(decoder):
    latent, state = jnp.array([0.3, -0.2, 0.5]), jnp.array([0.4, 1.0])

    def next_state(latent):
        return decoder.next_state(state, jnp.ones(1), latent).sum()

    assert next_state(latent) != next_state(latent + 1)  # it sees the latent
    np.testing.assert_array_equal(jax.jit(jax.grad(next_state))(latent), np.zeros(3))
    assert np.abs(jax.jit(jax.grad(lambda z: decoder.reward(state, z).mean))(latent)).min() > 0


def test_reward_is_a_weighted_distance_from_a_point_linear_in_the_latent(decoder):
    rng = np.random.default_rng(0)
    latent, state = rng.normal(size=(4, 3)).astype("f4"), rng.normal(size=(4, 2)).astype("f4")
    reference = latent @ decoder.reference.weights[0] + decoder.reference.biases[0]
    weights = jnp.log1p(jnp.exp(decoder.weights(latent)))
    expected = -(weights * jnp.abs(state - reference)).sum(axis=-1)
    np.testing.assert_allclose(decoder.reward(state, latent).mean, expected, rtol=1e-5)
    np.testing.assert_allclose(decoder.reward(reference, latent).mean, np.zeros(4), atol=1e-6)
    assert len(decoder.reference.weights) == 1
