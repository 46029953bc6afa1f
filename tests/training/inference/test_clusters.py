"""Clusters of beliefs: found without labels, judged by them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.inference.mixture.padded import no_clusters
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL as GOALS
from rebody.tasks.line import VELOCITY as SPEEDS
from rebody.training.inference.clusters import agreement, draw, new_mixture, refit, sample_beliefs
from rebody.training.inference.config import MixtureConfig
from rebody.training.inference.episodes import Episodes
from rebody.types import Belief, Task, global_state

GOAL, VELOCITY = range(2)
CENTRES = np.array([[-4.0, 0.0], [4.0, 0.0], [0.0, 6.0]])


@pytest.fixture
def settings(config):
    families, mixture = FamilySet((GOALS, SPEEDS)), MixtureConfig(points=80, from_decision=2, maximum=8)
    return replace(config, families=families, prior="mixture", mixture=mixture)


def episodes_at(centres, config, seed=0):
    """Episodes whose beliefs lie about one centre per base task, goal behind and in front, then velocity."""
    shape = (config.episodes, config.decisions)
    family = np.array([GOAL, GOAL, VELOCITY], np.int32)
    target = np.array([-5.0, 5.0, 2.0], np.float32)
    kind = np.arange(config.episodes) % len(centres)
    mean = centres[kind][:, None] + np.random.default_rng(seed).normal(0.0, 0.1, (shape[0], shape[1] + 1, 2))
    still = jnp.zeros(mean.shape[:2])
    task = Task(jnp.broadcast_to(family[kind, None], shape), jnp.broadcast_to(target[kind, None, None], (*shape, 1)))
    return Episodes(
        task=task,
        state=global_state(x=still),
        belief=Belief(jnp.asarray(mean, jnp.float32), jnp.full(mean.shape, 0.03)),
        action=jnp.zeros((*shape, 1)),
        reward=jnp.zeros(shape),
    )


def test_every_kind_of_task_gets_its_component(settings):
    clusters = no_clusters(8, 2)
    rng = np.random.default_rng(0)
    clusters, figures = refit(clusters, episodes_at(CENTRES, settings), settings, rng)
    assert figures["mixture/components"] == clusters.prior.active.sum() == 3
    assert figures["mixture/purity"] == figures["mixture/ari"] == 1.0
    found = np.asarray(clusters.prior.mean)[clusters.prior.active]
    assert np.sort(found, axis=0) == pytest.approx(np.sort(CENTRES, axis=0), abs=0.1)


def test_a_component_keeps_its_id_when_all_beliefs_move_a_little(settings):
    rng = np.random.default_rng(0)
    before, _ = refit(no_clusters(8, 2), episodes_at(CENTRES, settings), settings, rng)
    after, figures = refit(before, episodes_at(CENTRES + 0.3, settings, seed=1), settings, rng)

    def places(clusters):
        active = clusters.prior.active
        return dict(zip(clusters.ids[active].tolist(), np.asarray(clusters.prior.mean)[active], strict=True))

    assert places(before).keys() == places(after).keys()
    assert figures["mixture/births"] == 0
    for identity, place in places(after).items():
        assert place == pytest.approx(places(before)[identity] + 0.3, abs=0.1)


def test_the_number_of_components_can_be_fixed(settings):
    fixed = replace(settings, mixture=replace(settings.mixture, components=2))
    rng = np.random.default_rng(0)
    clusters, figures = refit(no_clusters(8, 2), episodes_at(CENTRES, fixed), fixed, rng)
    assert figures["mixture/components"] == clusters.prior.active.sum() == 2
    assert figures["mixture/ari"] < 1.0


def numbered(config):
    """Episodes whose beliefs say where they stand."""
    like = episodes_at(CENTRES, config)
    episode, time = np.mgrid[: config.episodes, : config.decisions + 1].astype(np.float32)
    sure = jnp.full(like.belief.mean.shape, 1e-10)
    return replace(like, belief=Belief(jnp.stack([episode, time], axis=-1), sure))


def test_beliefs_are_drawn_without_any_twice_and_late_enough(settings):
    latent, _ = sample_beliefs(numbered(settings), settings, np.random.default_rng(0))
    found = np.rint(latent).astype(int)
    assert found.shape == (80, 2)
    assert len(set(map(tuple, found))) == 80
    assert set(found[:, 0]) == set(range(settings.episodes))
    assert set(found[:, 1]) == set(range(2, settings.decisions + 1))


def test_when_there_are_fewer_beliefs_than_points_it_takes_them_all(settings):
    greedy = replace(settings, mixture=replace(settings.mixture, points=10_000))
    latent, _ = sample_beliefs(numbered(greedy), greedy, np.random.default_rng(0))
    assert len(set(map(tuple, np.rint(latent)))) == len(latent) == settings.episodes * (settings.decisions - 1)


def test_the_label_of_a_belief_is_that_of_the_decision_before_it(settings):
    """The task of its newest transition: in these episodes, another one at every decision."""
    switching = numbered(settings)
    sign = jnp.where(jnp.arange(settings.decisions) % 2, 1.0, -1.0)
    target = jnp.broadcast_to(sign[:, None], switching.task.target.shape)
    switching = replace(switching, task=Task(jnp.full(target.shape[:-1], VELOCITY), target))
    latent, label = sample_beliefs(switching, settings, np.random.default_rng(0))
    time = np.rint(latent[:, 1]).astype(int)
    np.testing.assert_array_equal(label, 2 * VELOCITY + (time - 1) % 2)


def test_what_is_clustered_are_latents_drawn_from_beliefs(settings):
    mean = np.repeat([[1.0, -2.0]], 40_000, axis=0)
    belief = Belief(mean, np.broadcast_to([0.25, 4.0], mean.shape))
    latent = draw(belief, settings, np.random.default_rng(0))
    np.testing.assert_allclose(latent.mean(axis=0), [1.0, -2.0], atol=0.04)
    np.testing.assert_allclose(latent.std(axis=0), [0.5, 2.0], rtol=0.02)
    assert abs(np.corrcoef(latent.T)[0, 1]) < 0.02
    np.testing.assert_array_equal(draw(belief, settings, np.random.default_rng(0)), latent)


def test_where_the_latent_is_split_kinds_alone_are_clustered(settings):
    """Its amounts, which differ wildly, do not disturb."""
    split = replace(settings, inference=replace(settings.inference, latent=4, kinds=2))
    episodes = episodes_at(CENTRES, split)
    amounts = jax.random.normal(jax.random.key(0), episodes.belief.mean.shape) * 100
    both = jax.tree.map(lambda kind, amount: jnp.concatenate([kind, jnp.abs(amount)], axis=-1), episodes.belief,
                        Belief(amounts, amounts))  # fmt: skip
    clusters, figures = refit(
        no_clusters(8, split.inference.clustered), replace(episodes, belief=both), split, np.random.default_rng(0)
    )
    assert (settings.inference.clustered, split.inference.clustered) == (2, 2)
    assert clusters.prior.mean.shape == (8, 2)
    assert figures["mixture/components"] == 3
    assert figures["mixture/purity"] == 1.0


def test_the_same_seed_finds_the_same_clusters(settings):
    one, other = (
        refit(no_clusters(8, 2), episodes_at(CENTRES, settings), settings, np.random.default_rng(5)) for _ in range(2)
    )
    assert one[1] == other[1]
    jax.tree.map(np.testing.assert_array_equal, one[0], other[0])


def test_a_new_mixture_has_the_settings_and_knows_nothing():
    settings = MixtureConfig(covariance_type="diag", concentration=2.0, prior_scale=0.3, components=4)
    mixture = new_mixture(settings, np.random.default_rng(0))
    assert (mixture.covariance_type, mixture.concentration, mixture.prior_scale) == ("diag", 2.0, 0.3)
    assert mixture.n_components == 4
    with pytest.raises(RebodyError, match="not been fitted"):
        mixture.predict(np.zeros((1, 2)))


def test_agreement_of_known_clusterings():
    label = np.array([0, 0, 0, 1, 1, 1])
    assert agreement(1 - label, label) == {"purity": 1.0, "ari": 1.0, "nmi": pytest.approx(1.0)}
    split = agreement(np.arange(6), label)  # every point alone is pure, and tells nothing
    assert split["purity"] == 1.0
    assert split["ari"] == pytest.approx(0.0)
    mixed = agreement(np.zeros(6, int), label)
    assert mixed["purity"] == 0.5
    assert mixed["ari"] == pytest.approx(0.0)
