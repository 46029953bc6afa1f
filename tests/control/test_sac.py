"""Soft actor-critic on problems whose answer is known, and that an update is what it was."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.control.sac import SACBatch, SACConfig, initial_state, take_over, update, update_many
from rebody.errors import RebodyError
from rebody.store import arrays_into_tree, load_artifact, save_artifact, tree_hash, tree_to_arrays

SIZE = 512
CONFIG = SACConfig(
    hidden=(32,),
    learning_rate=3e-3,
    final_learning_rate=3e-4,
    decay_updates=1500,
    discount=0.9,
    target_rate=0.05,
    average_rate=0.02,
    initial_temperature=1e-6,  # so that values are those of the reward alone
    batch_size=64,
)


@jax.jit
def train(data, key):
    """1500 updates on transitions drawn from `data`: one compiled program for every problem."""

    def one(state, key):
        batch_key, update_key = jax.random.split(key)
        chosen = jax.random.randint(batch_key, (CONFIG.batch_size,), 0, SIZE)
        return update(state, jax.tree.map(lambda leaf: leaf[chosen], data), update_key, CONFIG)

    keys = jax.random.split(key, 1501)
    return jax.lax.scan(one, initial_state(1, 1, CONFIG, keys[0]), keys[1:])


def trained(observation, reward, next_observation=0.0, terminal=1.0, seed=0):
    """The state after training on random actions; `reward` may be a function of the action."""
    action = jax.random.uniform(jax.random.key(9), (SIZE, 1), minval=-1.0, maxval=1.0)
    observation, next_observation, terminal = (
        jnp.broadcast_to(jnp.asarray(value, jnp.float32), (SIZE,))
        for value in (observation, next_observation, terminal)
    )
    reward = jnp.broadcast_to(jnp.asarray(reward(observation, action[:, 0])), (SIZE,))
    data = SACBatch(observation[:, None], action, reward, next_observation[:, None], terminal)
    return train(data, jax.random.key(seed))[0]


def values(state, observation, action=0.0):
    """Both critics' values of one observation and action."""
    return state.critics(jnp.asarray([observation], jnp.float32), jnp.asarray([action], jnp.float32))


# recorded from the implementation when the problems below had their known answers
GOLDEN = {
    "critic_loss": 1.032281,
    "value": 1.087055,
    "actor_loss": -1.437653,
    "entropy": 0.704305,
    "temperature": 0.099005,
    "action": 0.133118,
    "averaged action": 0.085619,
    "value after": 1.208452,
    "target value": 1.100721,
}

ALTERNATE = jnp.arange(SIZE) % 2


def test_value_of_a_constant_reward():
    state = trained(0.0, lambda observation, action: 1.0)
    np.testing.assert_allclose(values(state, 0.0), 1.0, atol=0.02)


def test_value_depends_on_the_observation():
    state = trained(2.0 * ALTERNATE - 1, lambda observation, action: observation)
    np.testing.assert_allclose(values(state, 1.0), 1.0, atol=0.05)
    np.testing.assert_allclose(values(state, -1.0), -1.0, atol=0.05)


def test_discounting_over_two_steps():
    """0 -> 1 without a reward, 1 -> end with a reward of 1."""
    state = trained(ALTERNATE, lambda observation, action: observation, next_observation=1.0, terminal=ALTERNATE)
    np.testing.assert_allclose(values(state, 1.0), 1.0, atol=0.05)
    np.testing.assert_allclose(values(state, 0.0), CONFIG.discount, atol=0.05)


def test_value_of_a_reward_for_ever():
    """1 / (1 - discount) = 10."""
    state = trained(0.0, lambda observation, action: 1.0, terminal=0.0)
    np.testing.assert_allclose(values(state, 0.0), 10.0, rtol=0.05)


def test_policy_finds_the_best_action():
    state = trained(0.0, lambda observation, action: -((action - 0.3) ** 2))
    for actor in (state.actor, state.averaged_actor):
        assert float(actor(jnp.zeros(1))[0]) == pytest.approx(0.3, abs=0.05)
    np.testing.assert_allclose(values(state, 0.0, -0.5), -0.64, atol=0.05)


def test_policy_finds_the_best_action_of_each_observation():
    state = trained(2.0 * ALTERNATE - 1, lambda observation, action: -((action - 0.5 * observation) ** 2))
    assert float(state.actor(jnp.ones(1))[0]) == pytest.approx(0.5, abs=0.07)
    assert float(state.actor(-jnp.ones(1))[0]) == pytest.approx(-0.5, abs=0.07)


def test_log_probability_is_that_of_the_squashed_gaussian():
    actor = initial_state(1, 1, CONFIG, jax.random.key(0)).actor
    action, log_prob = actor.sample(jnp.zeros((20_000, 1)), jax.random.key(1))
    # the mean of 1 / p over the samples within an interval is the length of that interval
    inside = jnp.abs(action[:, 0]) < 0.15
    assert float(jnp.mean(jnp.where(inside, jnp.exp(-log_prob[:, 0]), 0.0))) == pytest.approx(0.3, rel=0.03)


def small_batch():
    wave = jnp.sin(jnp.arange(8.0))
    return SACBatch(
        observation=jnp.stack([wave, wave**2], axis=-1),
        action=jnp.stack([wave[::-1]], axis=-1),
        reward=wave + 0.5,
        next_observation=jnp.stack([wave**2, wave], axis=-1),
        terminal=(wave > 0.9).astype(jnp.float32),
    )


@pytest.fixture(scope="module")
def small_config():
    return SACConfig(hidden=(8, 8), learning_rate=0.01, target_rate=0.1, average_rate=0.1)


@pytest.fixture(scope="module")
def one_update(small_config):
    """A function seed -> (state, metrics) after one update from weights that no seed decides."""

    @jax.jit
    def run(key):
        state = initial_state(2, 1, small_config, jax.random.key(0))
        networks = (state.actor, state.averaged_actor, state.critics, state.target_critics)
        state = replace_networks(state, jax.tree.map(wave_like, networks))
        return update(state, small_batch(), key, small_config)

    return lambda seed: run(jax.random.key(seed))


def wave_like(leaf):
    return 0.5 * jnp.sin(jnp.arange(leaf.size, dtype=jnp.float32)).reshape(leaf.shape)


def replace_networks(state, networks):
    return eqx.tree_at(lambda s: (s.actor, s.averaged_actor, s.critics, s.target_critics), state, networks)


def test_golden_values_of_one_update(one_update):
    state, metrics = one_update(0)
    batch = small_batch()
    after = {
        "action": state.actor(batch.observation),
        "averaged action": state.averaged_actor(batch.observation),
        "value after": state.critics(batch.observation, batch.action),
        "target value": state.target_critics(batch.observation, batch.action),
    }
    found = {name: float(value.mean()) for name, value in (metrics | after).items()}
    assert found == pytest.approx(GOLDEN, abs=1e-4)


def test_many_updates_are_one_after_the_other(small_config):
    """Each with its own inputs and keys; metrics are means."""
    keys = jax.random.split(jax.random.key(5), 3)
    shifts = jnp.asarray([0.0, 0.3, -0.5])

    def batch_of(shift, key):
        batch = small_batch()
        return eqx.tree_at(lambda b: b.reward, batch, batch.reward + shift + jax.random.uniform(key))

    begun = initial_state(2, 1, small_config, jax.random.key(0))
    found, metrics = eqx.filter_jit(update_many)(begun, batch_of, shifts, keys, small_config)
    one, state, losses = eqx.filter_jit(update), begun, []
    for shift, key in zip(shifts, keys, strict=True):
        batch_key, update_key = jax.random.split(key)
        state, measured = one(state, batch_of(shift, batch_key), update_key, small_config)
        losses.append(float(measured["critic_loss"]))
    observation = small_batch().observation
    np.testing.assert_allclose(found.actor(observation), state.actor(observation), atol=1e-4)
    assert np.abs(found.actor(observation) - begun.actor(observation)).max() > 1e-3
    assert float(metrics["critic_loss"]) == pytest.approx(np.mean(losses), rel=1e-3)
    assert np.ptp(losses) > 0.01


def test_a_trained_actor_is_taken_over_where_it_fits(small_config):
    state, other = (initial_state(2, 1, small_config, jax.random.key(seed)) for seed in (0, 1))
    taken = take_over(state, other.actor, "mine")
    assert tree_hash(taken.actor) == tree_hash(taken.averaged_actor) == tree_hash(other.actor)
    assert tree_hash(taken.critics) == tree_hash(state.critics)
    with pytest.raises(RebodyError, match="cannot start from 'mine': its networks have other sizes"):
        take_over(state, initial_state(3, 1, small_config, jax.random.key(0)).actor, "mine")


def test_same_seed_same_result(one_update):
    first, again, other = (tree_hash(one_update(seed)[0]) for seed in (3, 3, 4))
    assert first == again
    assert first != other


def test_saved_and_loaded_it_acts_the_same(one_update, small_config, tmp_path):
    actor = one_update(0)[0].averaged_actor
    save_artifact(tmp_path / "a", kind="tracker", config={}, weights=tree_to_arrays(actor), card="# Actor\n", log="")
    fresh = initial_state(2, 1, small_config, jax.random.key(5)).actor
    loaded = arrays_into_tree(fresh, load_artifact(tmp_path / "a", "tracker").arrays, "the actor")
    observation = small_batch().observation
    assert not np.array_equal(fresh(observation), actor(observation))
    np.testing.assert_array_equal(loaded(observation), actor(observation))
