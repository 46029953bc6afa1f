"""What the updates of meta-training are given."""

from dataclasses import replace
from itertools import pairwise

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.control.places import TaskCode, places_of
from rebody.inference.mixture.padded import no_clusters
from rebody.inference.prior import unit_gaussian
from rebody.store import tree_hash
from rebody.tasks.family_set import FamilySet
from rebody.tasks.line import VELOCITY as SPEEDS
from rebody.training.inference import train
from rebody.training.inference.episodes import Episodes, with_tasks
from rebody.training.inference.train import (
    latent_prior,
    sample_evidence,
    sample_transitions,
    trained_parts,
)
from rebody.training.replay import store_group
from rebody.types import Belief, GlobalState, Task

GOAL, VELOCITY = range(2)
FIELDS = tuple(GlobalState.__dataclass_fields__)
VX = FIELDS.index("vx") / 16


def number(group, episode, time):
    """Says in one number which entry of the replay it is."""
    return 10_000 * group + 100 * episode + time


@pytest.fixture(scope="module")
def labelled(config):
    """A replay whose values say where they stand."""
    group, episode, time = np.ogrid[: config.groups, : config.episodes, : config.decisions + 1]
    where = number(group, episode, time).astype(np.float32)
    state = GlobalState(**{name: where + FIELDS.index(name) / 16 for name in FIELDS})
    latent = np.repeat(where[..., None], config.inference.latent, axis=-1)
    return jax.tree.map(
        jnp.asarray,
        Episodes(
            task=Task(np.full(where[..., 1:].shape, GOAL, np.int32), where[..., :-1, None] / 1000),
            state=state,
            belief=Belief(latent + 0.5, (latent + 1.0) ** 2),
            action=where[..., :-1, None],
            reward=-where[..., :-1],
        ),
    )


def unpack(numbers):
    numbers = np.asarray(numbers).astype(int)
    return numbers // 10_000, numbers // 100 % 100, numbers % 100


@pytest.mark.parametrize("stored", [1, 2, 3])
def test_evidence_is_a_window_and_transitions_of_the_same_episode(labelled, config, stored):
    evidence = sample_evidence(labelled, stored, config, jax.random.key(0))
    window = evidence.window
    size, length = config.inference.batch_size, config.inference.window
    assert window.reward.shape == (size, length)
    assert evidence.reward.shape == (size, config.inference.decoded)

    group, episode, time = unpack(window.previous.x)
    assert set(group.ravel()) == set(range(stored))
    assert set(episode.ravel()) == set(range(config.episodes))
    np.testing.assert_array_equal(time, time[:, :1] + np.arange(length))
    for column in (group, episode):
        np.testing.assert_array_equal(column, column[:, :1] + np.zeros(length, int))
    assert set(time[:, 0]) == set(range(config.decisions - length + 1))
    np.testing.assert_array_equal(window.reward, -window.previous.x)
    np.testing.assert_array_equal(window.state.x, window.previous.x + 1)
    np.testing.assert_array_equal(window.state.vx, window.previous.x + 1 + VX)

    of_group, of_episode, at = unpack(evidence.previous.x)
    decoded = np.zeros(config.inference.decoded, int)
    np.testing.assert_array_equal(of_group, group[:, :1] + decoded)
    np.testing.assert_array_equal(of_episode, episode[:, :1] + decoded)
    assert set(at.ravel()) == set(range(config.decisions))
    np.testing.assert_array_equal(evidence.action[..., 0], evidence.previous.x)
    np.testing.assert_array_equal(evidence.reward, -evidence.previous.x)
    np.testing.assert_array_equal(evidence.state.x, evidence.previous.x + 1)


def test_many_windows_begin_with_their_episode(labelled, config):
    many = replace(config, inference=replace(config.inference, batch_size=4000))
    evidence = sample_evidence(labelled, 3, many, jax.random.key(1))
    begins = unpack(evidence.window.previous.x[:, 0])[2] == 0
    by_chance = 1 / (config.decisions - config.inference.window + 1)
    assert begins.mean() == pytest.approx(0.3 + 0.7 * by_chance, abs=0.03)


@pytest.mark.parametrize("stored", [1, 3])
def test_transitions_come_from_nominal_episodes_with_their_beliefs(labelled, config, stored):
    plain = replace(config, arrival=0.0, policy_scales=(1.0, 1.0))
    batch = sample_transitions(labelled, stored, plain, jax.random.key(0))
    x, vx, *belief = np.asarray(batch.observation).T
    group, episode, time = unpack(x)
    assert set(group) == set(range(stored))
    assert set(episode) == set(range(config.episodes // 2))
    assert set(time) == set(range(config.decisions))
    np.testing.assert_array_equal(vx, x + VX)
    for mean in belief[: config.inference.latent]:
        np.testing.assert_array_equal(mean, x + 0.5)
    for deviation in belief[config.inference.latent :]:
        np.testing.assert_allclose(deviation, x + 1.0, rtol=1e-5)
    np.testing.assert_array_equal(batch.action[:, 0], x)
    np.testing.assert_allclose(batch.reward, -x / plain.inference.reward_scale, rtol=1e-6)
    later = np.asarray(batch.next_observation).T
    np.testing.assert_array_equal(later[:4], [x + 1, vx + 1, *(mean + 1 for mean in belief[:2])])
    assert not np.asarray(batch.terminal).any()


def test_who_is_told_knows_the_task_that_is_on_at_every_decision(labelled, config):
    """In this replay, another one at every decision; the last one lasts."""
    told = with_tasks(labelled, TaskCode(places_of(config.families)))
    target = np.asarray(labelled.task.target)[..., 0] / 10.0
    assert told.belief.mean.shape == (*labelled.state.x.shape, 2)
    np.testing.assert_array_equal(told.belief.mean[..., 0], np.ones(labelled.state.x.shape))
    np.testing.assert_allclose(told.belief.mean[..., :-1, 1], target, rtol=1e-6)
    np.testing.assert_allclose(told.belief.mean[..., -1, 1], target[..., -1], rtol=1e-6)
    assert not np.asarray(told.belief.variance).any()
    for name in ("task", "state", "action", "reward"):
        assert tree_hash(getattr(told, name)) == tree_hash(getattr(labelled, name))


@pytest.fixture(scope="module")
def switched(labelled):
    """The replay, its episodes a speed forward until decision 5, then a goal behind."""
    shape = labelled.task.family.shape
    is_first = jnp.broadcast_to(jnp.arange(shape[-1]) < 5, shape)
    changing = Task(jnp.where(is_first, VELOCITY, GOAL), jnp.where(is_first, 2.0, -3.0)[..., None])
    return eqx.tree_at(lambda e: e.task, labelled, changing)


@pytest.mark.parametrize("window", [4, None])
def test_how_likely_a_task_has_changed_follows_from_time_alone(switched, config, window):
    families = config.families.beside(FamilySet((SPEEDS,)))
    carried = replace(config, families=families, inference=replace(config.inference, window=window), switch_share=0.5)
    evidence = sample_evidence(switched, 3, carried, jax.random.key(0))
    believed, explained = unpack(evidence.window.previous.x)[2], unpack(evidence.previous.x)[2]
    assert evidence.changed.shape == (300, window or config.decisions, config.inference.decoded)
    apart = np.abs(believed[:, :, None] - explained[:, None])
    np.testing.assert_allclose(evidence.changed, 1 - (1 - 0.5 / config.decisions) ** apart, atol=1e-6)
    np.testing.assert_array_equal(evidence.base_task, np.where(believed < 5, 2 * VELOCITY + 1, 2 * GOAL))


def test_where_tasks_never_change_a_belief_must_explain_all(switched, config):
    never = replace(config, families=config.families.beside(FamilySet((SPEEDS,))), switch_share=0.0)
    assert not np.asarray(sample_evidence(switched, 3, never, jax.random.key(0)).changed).any()


def test_without_a_window_the_encoder_learns_from_whole_episodes(labelled, config):
    carried = replace(config, inference=replace(config.inference, window=None))
    time = unpack(sample_evidence(labelled, 3, carried, jax.random.key(0)).window.previous.x)[2]
    np.testing.assert_array_equal(time, np.broadcast_to(np.arange(config.decisions), (300, config.decisions)))


def test_where_the_latent_is_split_the_mixture_is_for_the_kinds_alone(config):
    belief = Belief(np.array([[1.0, 2.0, 3.0]]), np.array([[0.5, 1.0, 2.0]]))
    kind, amount = (
        Belief(belief.mean[:, :1], belief.variance[:, :1]),
        Belief(belief.mean[:, 1:], belief.variance[:, 1:]),
    )
    split = replace(config.inference, latent=3, kinds=1, kind_weight=10.0)
    clusters = no_clusters(4, 1)
    clusters.prior.active[0], clusters.prior.mean[0], clusters.prior.spread[0] = True, 5.0, 2.0
    found = {
        prior: float(latent_prior(clusters, replace(config, inference=split, prior=prior))(belief)[0])
        for prior in ("gaussian", "mixture")
    }
    kinds, amounts = float(unit_gaussian(kind)[0]), float(unit_gaussian(amount)[0])
    assert found["gaussian"] == pytest.approx(10 * kinds + amounts, rel=1e-5)
    # KL of N(1, 0.5) to N(5, 1/2), whose log-determinant is said to be 0: 0.5 (2 * (0.5 + 16) - 1 - ln 0.5)
    assert found["mixture"] == pytest.approx(10 * 0.5 * (2 * 16.5 - 1 + np.log(2)) + amounts, rel=1e-5)
    assert latent_prior(clusters, config) is unit_gaussian
    assert latent_prior(clusters, replace(config, prior="mixture")) is clusters.prior


def test_a_mixture_is_kept_where_there_is_one(state, config):
    assert trained_parts(state, config).mixture is None
    kept = trained_parts(state, replace(config, prior="mixture")).mixture
    jax.tree.map(np.testing.assert_array_equal, kept, state.clusters.prior)


def test_what_is_kept_of_a_policy_that_explores_is_its_average(state, config):
    marked = eqx.tree_at(lambda s: s.sac.averaged_actor.net.mlp.biases[-1], state, jnp.full(2, 1.0))
    parts = trained_parts(marked, config)
    assert tree_hash(parts.high_level.actor) == tree_hash(marked.sac.averaged_actor)
    assert tree_hash(parts.told_policy.actor) == tree_hash(marked.told.actor)
    assert tree_hash(parts.module) == tree_hash(state.module)


def test_scales_divide_what_the_policy_sees(labelled, config):
    plain, scaled = (
        sample_transitions(labelled, 3, replace(config, policy_scales=scales), jax.random.key(0))
        for scales in ((1.0, 1.0), (10.0, 3.5))
    )
    np.testing.assert_allclose(scaled.observation[:, :2] * np.array([10.0, 3.5]), plain.observation[:, :2], rtol=1e-5)


def test_arrival_is_paid_on_the_spot_and_half_of_it_at_ten_centimetres(labelled, config):
    paid = replace(config, arrival=0.4)
    for earned, extra in ((0.0, 0.4), (-0.1, 0.2), (-10.0, 0.4 * 0.1 / 10.1)):
        replay = eqx.tree_at(lambda e: e.reward, labelled, jnp.full_like(labelled.reward, earned))
        batch = sample_transitions(replay, 3, paid, jax.random.key(0))
        np.testing.assert_allclose(batch.reward, earned / 10.0 + extra, rtol=1e-5)


def test_the_newest_episodes_replace_the_oldest(labelled, config):
    replay = jax.tree.map(jnp.zeros_like, labelled)
    for iteration in range(5):
        new = jax.tree.map(lambda leaf, i=iteration: jnp.full_like(leaf[0], i + 1), labelled)
        replay, stored = store_group(replay, new, jnp.asarray(iteration))
        assert int(stored) == min(iteration + 1, 3)
    for leaf in jax.tree.leaves(replay):
        np.testing.assert_array_equal(leaf.reshape(3, -1).T - np.array([4, 5, 3]), 0)


def test_inference_is_frozen_while_the_policy_learns_on(pipelines, tmp_path, monkeypatch):
    """One turn of wandering: all but the policy of beliefs. Two with all. Then that policy alone."""
    states, iterate = [], train.iterate
    monkeypatch.setattr(train, "iterate", lambda state, *rest: states.append(state) or iterate(state, *rest))
    assert pipelines["inference"](tmp_path / "run") == 0

    def changed(part):
        return [tree_hash(part(old)) != tree_hash(part(new)) for old, new in pairwise(states[:6])]

    assert [int(state.iteration) for state in states] == list(range(9))
    assert changed(lambda state: state.module.encoder) == [True, True, True, False, False]
    assert changed(lambda state: state.module.decoder.experts) == [True, True, True, False, False]
    assert changed(lambda state: state.sac.actor) == [False, True, True, True, True]
    assert changed(lambda state: state.told.actor) == [True, True, True, False, False]
    assert changed(lambda state: state.clusters) == [False, True, True, False, False]
    assert changed(lambda state: state.replay.reward) == 5 * [True]
