"""Episodes on the toy: who acts how, and what is believed along them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.toys import MassDamper, Randomisation, make_toy
from rebody.control.high_level import policy_observation
from rebody.tasks import GOAL
from rebody.training.inference.episodes import collect, refresh_beliefs, roles
from rebody.types import Transition

TOY = MassDamper()


@pytest.fixture(scope="module")
def episodes(config, state):
    """Episodes of every role."""
    return collect(state.module.encoder, state.sac.actor, TOY, config, roles(8, False), jax.random.key(1))


def test_roles_are_quarters(config):
    acting = roles(8, all_wander=False)
    np.testing.assert_array_equal(acting.decides, [1, 1, 0, 0, 0, 0, 0, 0])
    np.testing.assert_array_equal(acting.wanders, [0, 0, 0, 0, 0, 0, 1, 1])
    assert np.asarray(roles(8, all_wander=True).wanders).all()
    # the policy learns from the first half: it holds deciders and samplers, but no wanderers
    for size in (4, 7, 48):
        acting = roles(size, all_wander=False)
        assert np.asarray(acting.decides)[: size // 2].any()
        assert not np.asarray(acting.wanders)[: size // 2].any()


def test_episodes_are_what_learning_expects(episodes, config):
    shape = (config.episodes, config.decisions)
    assert episodes.reward.shape == shape
    assert episodes.action.shape == (*shape, 1)
    assert episodes.state.x.shape == (shape[0], shape[1] + 1)
    assert episodes.belief.mean.shape == (shape[0], shape[1] + 1, config.inference.latent)


def test_one_hidden_task_explains_all_rewards_of_an_episode(episodes):
    """Reward i is that of the state after action i."""
    x, distance = np.asarray(episodes.state.x)[:, 1:], -np.asarray(episodes.reward)
    ahead, behind = x + distance, x - distance  # one of them is the target, at every decision
    first = np.stack([ahead[:, 0], behind[:, 0]])[..., None]
    misses = np.minimum(np.abs(ahead - first), np.abs(behind - first)).max(axis=-1)
    assert misses.min(axis=0).max() < 1e-4
    targets = np.where(misses[0] < misses[1], *first[..., 0])
    assert (np.abs(targets) <= 10).all()
    assert len(set(targets.round(3))) == len(targets)
    np.testing.assert_allclose(targets, episodes.task.target, atol=1e-4)
    np.testing.assert_array_equal(episodes.task.family, np.full(len(targets), GOAL))


def test_the_first_half_is_nominal_and_moves_by_its_actions(episodes, config):
    half = config.episodes // 2
    x, vx, action = (np.asarray(a)[:half] for a in (episodes.state.x, episodes.state.vx, episodes.action[..., 0]))
    speed = vx[:, :-1] + 0.1 * (7.0 * action - 2.0 * vx[:, :-1])
    np.testing.assert_allclose(vx[:, 1:], speed, atol=1e-5)
    np.testing.assert_allclose(x[:, 1:], x[:, :-1] + 0.1 * speed, atol=1e-5)


def test_on_the_position_toy_a_step_is_a_tenth_of_a_metre_at_most(config, state):
    calm = replace(config, randomisation=Randomisation(0.0, lag=0.0, gain=(1.0, 1.0)), start=(12.0, 0.0))
    key = jax.random.key(4)
    moved = collect(state.module.encoder, state.sac.actor, make_toy("position"), calm, roles(8, True), key)
    np.testing.assert_allclose(np.diff(moved.state.x, axis=1), 0.1 * moved.action[..., 0], atol=1e-5)


def test_the_second_half_is_disturbed(episodes, config):
    half = config.episodes // 2
    vx, action = np.asarray(episodes.state.vx)[half:], np.asarray(episodes.action)[half:, :, 0]
    speed = vx[:, :-1] + 0.1 * (7.0 * action - 2.0 * vx[:, :-1])
    assert (np.abs(vx[:, 1:] - speed).max(axis=1) > 0.01).all()


def test_those_who_decide_take_the_most_likely_action(episodes, config, state):
    now = jax.tree.map(lambda leaf: leaf[:, :-1], (episodes.state, episodes.belief))
    likely = state.sac.actor(policy_observation(*now, config.policy_fields, config.policy_scales))
    away = np.abs(np.asarray(episodes.action - likely))[..., 0].max(axis=1)
    np.testing.assert_array_equal(away < 1e-5, roles(8, False).decides)


def test_those_who_wander_hold_their_actions(episodes):
    turns = (np.diff(np.asarray(episodes.action)[..., 0], axis=1) != 0).mean(axis=1)
    assert (turns[6:] < 0.6).all()
    assert (turns[:6] == 1.0).all()
    assert (np.abs(episodes.action) <= 1).all()


def test_episodes_start_anywhere_at_any_speed(config, state):
    wide = replace(config, episodes=400, decisions=1, start=(5.0, 2.0))
    started = collect(state.module.encoder, state.sac.actor, TOY, wide, roles(400, True), jax.random.key(2)).state
    for begun, limit in ((started.x[:, 0], 5.0), (started.vx[:, 0], 2.0)):
        assert 0.97 * limit < np.abs(begun).max() <= limit
        assert abs(np.mean(begun)) < 0.15 * limit
    assert abs(np.corrcoef(started.x[:, 0], started.vx[:, 0])[0, 1]) < 0.2


def test_nothing_is_believed_before_the_first_transition(episodes):
    assert not np.asarray(episodes.belief.mean)[:, 0].any()
    assert (np.asarray(episodes.belief.variance)[:, 0] == 1).all()


def test_beliefs_rest_on_the_window_alone(episodes, config, state):
    """The last belief is the one that a fresh look at the last W transitions gives."""
    window = config.inference.window
    before = jax.tree.map(lambda leaf: leaf[:, -window - 1 : -1], episodes.state)
    after = jax.tree.map(lambda leaf: leaf[:, -window:], episodes.state)
    fresh = state.module.encoder.along(Transition(before, episodes.reward[:, -window:], after))
    np.testing.assert_allclose(fresh.mean[:, -1], episodes.belief.mean[:, -1], atol=1e-5)
    np.testing.assert_allclose(fresh.variance[:, -1], episodes.belief.variance[:, -1], rtol=1e-4)


def test_refreshed_beliefs_are_those_made_while_collecting(episodes, config, state):
    groups = jax.tree.map(lambda leaf: jnp.stack([leaf, jnp.flip(leaf, axis=0)]), episodes)
    fresh = refresh_beliefs(state.module.encoder, groups)
    for new, old in zip(jax.tree.leaves(fresh), jax.tree.leaves(groups), strict=True):
        assert new.shape == old.shape
        np.testing.assert_allclose(new, old, atol=1e-5)


def test_refreshing_changes_nothing_but_beliefs(episodes, state):
    other = jax.tree.map(lambda leaf: 1.1 * leaf if isinstance(leaf, jax.Array) else leaf, state.module.encoder)
    groups = jax.tree.map(lambda leaf: leaf[None], episodes)
    fresh = refresh_beliefs(other, groups)
    assert np.abs(fresh.belief.mean - groups.belief.mean).max() > 1e-3
    for name in ("task", "state", "action", "reward"):
        for new, old in zip(*map(jax.tree.leaves, (getattr(fresh, name), getattr(groups, name))), strict=True):
            np.testing.assert_array_equal(new, old)


def test_observations_can_be_noisy(config, state):
    calm = replace(config, episodes=100, decisions=20, randomisation=Randomisation(0.0, lag=0.0, gain=(1.0, 1.0)))
    noisy = replace(calm, observation_noise=0.04)
    clean, rough = (
        collect(state.module.encoder, state.sac.actor, TOY, c, roles(100, True), jax.random.key(3))
        for c in (calm, noisy)
    )
    np.testing.assert_array_equal(clean.action, rough.action)  # wanderers do not look
    np.testing.assert_array_equal(clean.reward, rough.reward)  # paid for where they are, not where they seem
    for name in ("x", "vx", "pitch"):
        noise = np.asarray(getattr(rough.state, name) - getattr(clean.state, name))
        assert np.std(noise) == pytest.approx(0.2, rel=0.1)
        assert abs(np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]) < 0.1
