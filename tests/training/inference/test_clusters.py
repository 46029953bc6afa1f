"""Clusters of beliefs: found without labels, judged by them."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from rebody.inference.mixture.padded import no_clusters
from rebody.tasks import GOAL, VELOCITY
from rebody.training.inference.clusters import agreement, base_task, refit
from rebody.training.inference.config import MixtureConfig
from rebody.training.inference.episodes import Episodes
from rebody.types import Belief, GlobalState, Task

CENTRES = np.array([[-4.0, 0.0], [4.0, 0.0], [0.0, 6.0]])


@pytest.fixture
def settings(config):
    return replace(config, prior="mixture", mixture=MixtureConfig(points=300, from_decision=2, maximum=8))


def episodes_at(centres, config, seed=0):
    """Episodes whose beliefs lie about one centre per base task, goal behind and in front, then velocity."""
    shape = (config.groups, config.episodes, config.decisions)
    family = np.array([GOAL, GOAL, VELOCITY], np.int32)
    target = np.array([-5.0, 5.0, 2.0], np.float32)
    kind = np.arange(config.groups * config.episodes).reshape(shape[:2]) % len(centres)
    noise = np.random.default_rng(seed).normal(0.0, 0.2, (*shape[:2], shape[2] + 1, 2))
    still = jnp.zeros((*shape[:2], shape[2] + 1))
    return Episodes(
        task=Task(jnp.asarray(family[kind]), jnp.asarray(target[kind])),
        state=GlobalState(still, still, still, still, still, still, still, still),
        belief=Belief(jnp.asarray(centres[kind][:, :, None] + noise, jnp.float32), jnp.ones(noise.shape)),
        action=jnp.zeros((*shape, 1)),
        reward=jnp.zeros(shape),
    )


def test_every_kind_of_task_gets_its_component(settings):
    clusters = no_clusters(8, 2)
    rng = np.random.default_rng(0)
    clusters, figures = refit(clusters, episodes_at(CENTRES, settings), settings.groups, settings, rng)
    assert figures["mixture/components"] == clusters.prior.active.sum() == 3
    assert figures["mixture/purity"] == figures["mixture/ari"] == 1.0
    found = np.asarray(clusters.prior.mean)[clusters.prior.active]
    assert np.sort(found, axis=0) == pytest.approx(np.sort(CENTRES, axis=0), abs=0.1)


def test_a_component_keeps_its_id_when_all_beliefs_move_a_little(settings):
    rng = np.random.default_rng(0)
    before, _ = refit(no_clusters(8, 2), episodes_at(CENTRES, settings), settings.groups, settings, rng)
    after, figures = refit(before, episodes_at(CENTRES + 0.3, settings, seed=1), settings.groups, settings, rng)

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
    clusters, figures = refit(no_clusters(8, 2), episodes_at(CENTRES, fixed), fixed.groups, fixed, rng)
    assert figures["mixture/components"] == clusters.prior.active.sum() == 2
    assert figures["mixture/ari"] < 1.0


def test_front_and_back_are_two_base_tasks():
    task = Task(np.array([GOAL, GOAL, VELOCITY, VELOCITY]), np.array([-1.0, 1.0, -1.0, 1.0]))
    assert len(set(base_task(task).tolist())) == 4


def test_agreement_of_known_clusterings():
    label = np.array([0, 0, 0, 1, 1, 1])
    assert agreement(1 - label, label) == {"purity": 1.0, "ari": 1.0, "nmi": pytest.approx(1.0)}
    split = agreement(np.arange(6), label)  # every point alone is pure, and tells nothing
    assert split["purity"] == 1.0
    assert split["ari"] == pytest.approx(0.0)
    mixed = agreement(np.zeros(6, int), label)
    assert mixed["purity"] == 0.5
    assert mixed["ari"] == pytest.approx(0.0)
