"""Episodes on the toy: who acts how, and what is believed along them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies.disturbance import CALM
from rebody.bodies.toys import FullToy, MassDamper, make_toy
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL, STAND
from rebody.training.inference.episodes import collect, refresh_beliefs, roles
from rebody.training.inference.train import initial_state
from rebody.types import Transition

TOY = MassDamper()


@pytest.fixture(scope="module")
def episodes(config, state):
    """Episodes of every role."""
    return collect(state.module, state.sac.actor, TOY, config, roles(8, False), jax.random.key(1))


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
    assert episodes.reward.shape == episodes.task.family.shape == shape
    assert episodes.task.target.shape == (*shape, 1)
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
    np.testing.assert_allclose(episodes.task.target[..., 0], np.broadcast_to(targets[:, None], x.shape), atol=1e-4)
    np.testing.assert_array_equal(episodes.task.family, np.zeros(x.shape))


def test_each_decision_is_paid_for_the_task_that_is_on(config, state):
    """In every episode the task changes, and nothing but the rewards tells."""
    switching, steady = (
        collect(
            state.module, state.sac.actor, TOY, replace(config, switch_share=share), roles(8, True),
            jax.random.key(5),
        )
        for share in (1.0, 0.0)
    )  # fmt: skip
    changes = np.diff(switching.task.target[..., 0], axis=1) != 0
    np.testing.assert_array_equal(changes.sum(axis=1), np.ones(8))
    assert len(set(np.nonzero(changes)[1])) > 2
    after = jax.tree.map(lambda leaf: leaf[:, 1:], switching.state)
    np.testing.assert_allclose(switching.reward, config.families.reward(switching.task, after), rtol=1e-5)
    np.testing.assert_array_equal(switching.action, steady.action)  # wanderers do not listen
    np.testing.assert_array_equal(switching.task.target[:, 0], steady.task.target[:, 0])
    before = np.cumsum(changes, axis=1) == 0
    np.testing.assert_array_equal(switching.reward[:, 1:][before], steady.reward[:, 1:][before])


def test_the_first_half_is_nominal_and_moves_by_its_actions(episodes, config):
    half = config.episodes // 2
    x, vx, action = (np.asarray(a)[:half] for a in (episodes.state.x, episodes.state.vx, episodes.action[..., 0]))
    speed = vx[:, :-1] + 0.1 * (7.0 * action - 2.0 * vx[:, :-1])
    np.testing.assert_allclose(vx[:, 1:], speed, atol=1e-5)
    np.testing.assert_allclose(x[:, 1:], x[:, :-1] + 0.1 * speed, atol=1e-5)


def test_on_the_position_toy_a_step_is_a_tenth_of_a_metre_at_most(config, state):
    calm = replace(config, randomisation=CALM, start=(12.0, 0.0))
    key = jax.random.key(4)
    moved = collect(state.module, state.sac.actor, make_toy("position"), calm, roles(8, True), key)
    np.testing.assert_allclose(np.diff(moved.state.x, axis=1), 0.1 * moved.action[..., 0], atol=1e-5)


def test_the_second_half_is_disturbed(episodes, config):
    half = config.episodes // 2
    vx, action = np.asarray(episodes.state.vx)[half:], np.asarray(episodes.action)[half:, :, 0]
    speed = vx[:, :-1] + 0.1 * (7.0 * action - 2.0 * vx[:, :-1])
    assert (np.abs(vx[:, 1:] - speed).max(axis=1) > 0.01).all()


def test_those_who_decide_take_the_most_likely_action(episodes, config, state):
    now = jax.tree.map(lambda leaf: leaf[:, :-1], (episodes.state, episodes.belief))
    likely = state.sac.actor(config.policy_view(*now))
    away = np.abs(np.asarray(episodes.action - likely))[..., 0].max(axis=1)
    np.testing.assert_array_equal(away < 1e-5, roles(8, False).decides)


def test_those_who_wander_hold_their_actions(episodes):
    turns = (np.diff(np.asarray(episodes.action)[..., 0], axis=1) != 0).mean(axis=1)
    assert (turns[6:] < 0.6).all()
    assert (turns[:6] == 1.0).all()
    assert (np.abs(episodes.action) <= 1).all()


def test_episodes_start_anywhere_at_any_speed(config, state):
    wide = replace(config, episodes=400, decisions=config.inference.window, start=(5.0, 2.0))
    started = collect(state.module, state.sac.actor, TOY, wide, roles(400, True), jax.random.key(2)).state
    for begun, limit in ((started.x[:, 0], 5.0), (started.vx[:, 0], 2.0)):
        assert 0.97 * limit < np.abs(begun).max() <= limit
        assert abs(np.mean(begun)) < 0.15 * limit
    assert abs(np.corrcoef(started.x[:, 0], started.vx[:, 0])[0, 1]) < 0.2


def test_disturbed_episodes_may_start_farther_out(config, state):
    decisions = config.inference.window
    wide = replace(config, episodes=400, decisions=decisions, start=(5.0, 2.0), disturbed_start=(20.0, 1.0))
    started = collect(state.module, state.sac.actor, TOY, wide, roles(400, True), jax.random.key(2)).state
    for half, limits in ((slice(0, 200), (5.0, 2.0)), (slice(200, 400), (20.0, 1.0))):
        for begun, limit in zip((started.x[half, 0], started.vx[half, 0]), limits, strict=True):
            assert 0.95 * limit < np.abs(begun).max() <= limit


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
    half = config.episodes // 2
    turned = jax.tree.map(lambda leaf: jnp.concatenate([leaf[:half][::-1], leaf[half:]]), episodes)
    groups = jax.tree.map(lambda *leaves: jnp.stack(leaves), episodes, turned)
    fresh = refresh_beliefs(state.module.encoder, groups, groups.reward.shape[1] // 2)
    for new, old in zip(jax.tree.leaves(fresh), jax.tree.leaves(groups), strict=True):
        assert new.shape == old.shape
        np.testing.assert_allclose(new, old, atol=1e-5)


def test_refreshing_changes_nothing_but_beliefs_of_the_nominal_half(episodes, config, state):
    other = jax.tree.map(lambda leaf: 1.1 * leaf if isinstance(leaf, jax.Array) else leaf, state.module.encoder)
    groups = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), episodes)
    fresh = refresh_beliefs(other, groups, groups.reward.shape[1] // 2)
    half = config.episodes // 2
    for name in ("mean", "variance"):
        apart = np.abs(getattr(fresh.belief, name) - getattr(groups.belief, name))
        assert (apart[:, :half, 1:].max(axis=(-2, -1)) > 1e-4).all()
        assert not apart[:, half:].any()
        assert not apart[:, :, 0].any()
    for name in ("task", "state", "action", "reward"):
        for new, old in zip(*map(jax.tree.leaves, (getattr(fresh, name), getattr(groups, name))), strict=True):
            np.testing.assert_array_equal(new, old)


@pytest.fixture(scope="module")
def standing(config):
    """Settings of the full toy, which stands at a pitch."""
    inference = replace(config.inference, fields=("x", "pitch"), scales=(10.0, 1.5), window=None, latent=3, kinds=1)
    fields = {"policy_fields": ("x", "pitch", "pitch_rate"), "policy_scales": (10.0, 1.5, 3.0)}
    stand, goal = STAND.within(interval(0.5, 1.5), law="plain"), GOAL.within(interval(-9.0, -1.0), law="plain")
    return replace(config, inference=inference, families=FamilySet((goal, stand)), toy="full", **fields)


@pytest.fixture(scope="module")
def stood(standing):
    """Episodes of the full toy, and the encoder that believed along them."""
    begun = initial_state(standing, FullToy(), jax.random.key(0))
    encoder = begun.module.encoder
    return encoder, collect(begun.module, begun.sac.actor, FullToy(), standing, roles(8, False), jax.random.key(1))


def test_the_full_toy_acts_in_three_ways_and_is_paid_for_its_pitch(stood, standing):
    _, episodes = stood
    assert episodes.action.shape == (8, standing.decisions, 3)
    assert np.std(episodes.action, axis=(0, 1)).min() > 0.1
    assert set(np.asarray(episodes.task.family).ravel()) == {0, 1}
    after = jax.tree.map(lambda leaf: leaf[:, 1:], episodes.state)
    achieved = np.where(episodes.task.family == 1, after.pitch, after.x)
    np.testing.assert_allclose(episodes.reward, -np.abs(achieved - episodes.task.target[..., 0]), rtol=1e-4, atol=1e-5)
    assert not np.asarray(episodes.state.z).min() < 0
    assert np.asarray(episodes.state.z).max() > 0


def test_without_a_window_refreshed_beliefs_are_those_made_while_collecting(stood):
    encoder, episodes = stood
    transitions = Transition(
        jax.tree.map(lambda leaf: leaf[:, :-1], episodes.state),
        episodes.reward,
        jax.tree.map(lambda leaf: leaf[:, 1:], episodes.state),
    )
    whole = encoder.along(transitions)
    np.testing.assert_allclose(whole.mean, episodes.belief.mean[:, 1:], rtol=1e-4, atol=1e-5)
    groups = jax.tree.map(lambda leaf: leaf[None], episodes)
    forgotten = jax.tree.map(jnp.zeros_like, groups.belief)
    fresh = refresh_beliefs(encoder, replace(groups, belief=forgotten), groups.reward.shape[1] // 2).belief
    np.testing.assert_allclose(fresh.mean[0, :4], episodes.belief.mean[:4], rtol=1e-4, atol=1e-5)
    assert not np.asarray(fresh.mean[0, 4:]).any()


def test_a_full_toy_starts_at_any_pitch_that_it_can_hold(standing):
    wide = replace(standing, episodes=400, decisions=1)
    begun = initial_state(wide, FullToy(), jax.random.key(0))
    started = collect(begun.module, begun.sac.actor, FullToy(), wide, roles(400, True), jax.random.key(2)).state
    pitch = np.asarray(started.pitch)[:, 0]
    assert 0.97 * 2.25 < np.abs(pitch).max() <= 2.25
    assert abs(pitch.mean()) < 0.15 * 2.25
    assert abs(np.corrcoef(started.x[:, 0], pitch)[0, 1]) < 0.2
    assert not np.asarray(started.z)[:, 0].any()
    assert not np.asarray(started.pitch_rate)[:, 0].any()


def test_observations_can_be_noisy(config, state):
    calm = replace(config, episodes=100, decisions=20, randomisation=CALM)
    noisy = replace(calm, observation_noise=0.04)
    clean, rough = (
        collect(state.module, state.sac.actor, TOY, c, roles(100, True), jax.random.key(3)) for c in (calm, noisy)
    )
    np.testing.assert_array_equal(clean.action, rough.action)  # wanderers do not look
    np.testing.assert_array_equal(clean.reward, rough.reward)  # paid for where they are, not where they seem
    for name in ("x", "vx", "pitch"):
        noise = np.asarray(getattr(rough.state, name) - getattr(clean.state, name))
        assert np.std(noise) == pytest.approx(0.2, rel=0.1)
        assert abs(np.corrcoef(noise[:, 1:].ravel(), noise[:, :-1].ravel())[0, 1]) < 0.1
