"""Which slot a belief is about."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.agent import ReuseAgent
from rebody.agents.build import build_agent, slot_chooser
from rebody.agents.parts import LoadedSlots, SlotParts, load_inference
from rebody.agents.slots import OneSlot, SlotClassifier, SlotOfCluster
from rebody.errors import RebodyError
from rebody.inference.mixture.padded import no_mixture
from rebody.nn import MLP
from rebody.store import tree_hash
from rebody.types import Belief, global_state

LATENT = 5
GOAL, VELOCITY, STAND = 0, 1, 2
"""Indices of families, in a module of three."""


@pytest.fixture(scope="module")
def belief():
    mean = np.random.default_rng(0).normal(size=(7, 3, LATENT)).astype(np.float32)
    return Belief(mean, np.full_like(mean, 0.1))


@pytest.fixture(scope="module")
def classifier():
    """Never of a goal; of a velocity or a stand by the sign of one number."""
    net = MLP(LATENT, 3, (), key=jax.random.key(0))
    weights = np.zeros((LATENT, 3), np.float32)
    weights[1] = (0.0, -1.0, 1.0)
    return SlotClassifier(
        eqx.tree_at(lambda n: (n.weights[0], n.biases[0]), net, (jnp.asarray(weights), jnp.array([-99.0, 0, 0])))
    )


@pytest.fixture(scope="module")
def module(full_module):
    return load_inference(str(full_module))


@pytest.fixture(scope="module")
def loaded(module):
    families = module.contract.families.names
    net = MLP(module.parts.module.encoder.latent, len(families), (), key=jax.random.key(0))
    of_cluster = np.full(len(module.parts.mixture.active), STAND, np.int32)
    return LoadedSlots("tiny", tree_hash(module.parts.module), families, SlotParts(SlotClassifier(net), of_cluster))


def test_one_family_needs_no_choice(belief):
    slot = OneSlot(VELOCITY)(belief)
    assert slot.shape == (7, 3)
    assert (slot == VELOCITY).all()


def test_a_classifier_takes_the_likeliest(belief, classifier):
    expected = np.where(belief.mean[..., 1] > 0, STAND, VELOCITY)
    assert len(np.unique(expected)) == 2
    np.testing.assert_array_equal(classifier(belief), expected)


def test_a_cluster_has_its_slot(belief):
    """Two components, far apart in the dimensions that are clustered: the first two."""
    nothing = no_mixture(4, 2)
    identity = np.broadcast_to(np.eye(2, dtype=np.float32), (4, 2, 2))
    mixture = replace(
        nothing,
        active=np.array([True, True, False, False]),
        mean=np.array([[-2, 0], [2, 0], [0, 0], [0, 0]], np.float32),
        root=identity,
        nu=np.full(4, 4.0, np.float32),
        kappa=np.full(4, 10.0, np.float32),
    )
    slots = SlotOfCluster(mixture, np.array([VELOCITY, GOAL, STAND, STAND], np.int32))
    np.testing.assert_array_equal(slots(belief), np.where(belief.mean[..., 0] > 0, GOAL, VELOCITY))


def test_a_subgoal_goes_to_the_slot_of_its_belief(module, classifier):
    """The value is that field of where the imagined toy would be."""
    agent = build_agent("reuse", module, slots=classifier, horizon=3)
    assert isinstance(agent, ReuseAgent)
    latent = module.parts.module.encoder.latent
    mean = np.zeros((2, latent), np.float32)
    mean[:, 1] = (-5.0, 5.0)
    belief = Belief(mean, np.ones_like(mean))
    still = np.zeros(2, np.float32)
    state = global_state(vx=still + 0.5)
    command = agent.command(state, belief, jnp.zeros((), jnp.int32))
    np.testing.assert_array_equal(command.subgoal.slot, [VELOCITY, STAND])
    ahead = jax.tree.map(lambda leaf: leaf[-1], agent.imagine(state, belief))
    expected = module.contract.families.achieved(np.array([VELOCITY, STAND]), ahead)
    np.testing.assert_allclose(command.subgoal.value, expected)


def test_several_families_need_a_classifier(module, inference):
    with pytest.raises(RebodyError, match=r"'full' tells several families apart.*rebody train classifier"):
        slot_chooser(module, None, "classifier")
    assert slot_chooser(inference, None, "classifier") == OneSlot(GOAL)


def test_a_classifier_understands_one_module_only(module, loaded):
    assert slot_chooser(module, loaded, "classifier") is loaded.parts.classifier
    clusters = slot_chooser(module, loaded, "clusters")
    assert isinstance(clusters, SlotOfCluster)
    np.testing.assert_array_equal(clusters.slots, STAND)
    with pytest.raises(RebodyError, match="'tiny' was trained on the beliefs of another module than 'full'"):
        slot_chooser(module, replace(loaded, inference_hash="0"), "classifier")


def test_there_are_no_clusters_without_a_mixture(module, loaded):
    parts = eqx.tree_at(lambda p: p.mixture, module.parts, None, is_leaf=lambda leaf: leaf is module.parts.mixture)
    with pytest.raises(RebodyError, match="has no mixture"):
        slot_chooser(replace(module, parts=parts), loaded, "clusters")
