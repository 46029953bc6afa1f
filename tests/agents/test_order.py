"""An index means nothing outside of one set: a module whose families stand in another order acts the same."""

import copy

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.agent import Observation
from rebody.agents.build import build_agent
from rebody.agents.clock import begin, decide
from rebody.agents.live import LiveAgent
from rebody.agents.parts import LoadedSlots, load_inference, load_slots, load_tracker
from rebody.agents.slots import SlotClassifier
from rebody.bodies import RobotBatch
from rebody.store import load_artifact, save_artifact, tree_hash
from rebody.types import Task, global_state

NAME = "goal-velocity-stand"
KINDS, LATENT, FIELDS, OWN = 3, 9, 3, 2
"""Of that module; how many numbers of the latent each family has."""
ORDERS = [(2, 0, 1), (1, 0, 2)]
"""Families, by their indices in the shipped module."""
DECISIONS = 12


def latent_order(order):
    """What each number of the other latent is in the shipped one."""
    return np.concatenate([np.arange(KINDS), *(KINDS + OWN * family + np.arange(OWN) for family in order)])


def rows_last(array, order, count):
    """With its last `count` rows in another order."""
    return np.concatenate([array[:-count], array[-count:][order]])


def blocks(columns, order):
    """Numbers that each family has one of, block by block."""
    return np.concatenate([columns[i : i + len(order)][list(order)] for i in range(0, len(columns), len(order))])


def reordered_module(artifact, order):
    """Config and weights of the module whose families stand in that order."""
    order, latent = list(order), latent_order(order)
    config = copy.deepcopy(artifact.config)
    known = config["contract"]["families"]["families"]
    config["contract"]["families"]["families"] = [known[i] for i in order]
    arrays = {name: array.copy() for name, array in artifact.arrays.items()}

    def change(name, reorder):
        arrays[name] = reorder(artifact.arrays[name])

    both = np.concatenate([latent, LATENT + latent])  # mean and variance
    change("module.encoder.head.weights.2", lambda w: w[:, both])
    change("module.encoder.head.biases.2", lambda b: b[both])
    amounts = latent[KINDS:] - KINDS
    change("module.encoder.gate.weights.1", lambda w: w.reshape(len(w), len(amounts), -1)[:, amounts].reshape(w.shape))
    change("module.encoder.gate.biases.1", lambda b: b.reshape(len(amounts), -1)[amounts].ravel())
    change("module.decoder.state_head.weights.0", lambda w: rows_last(w, latent, LATENT))
    change("module.decoder.log_variance.weights.0", lambda w: rows_last(w, latent, LATENT))
    change("module.decoder.choice.weights.0", lambda w: w[:, order])
    change("module.decoder.choice.biases.0", lambda b: b[order])
    for name in (name for name in artifact.arrays if name.startswith("module.decoder.experts.")):
        _, _, _, i, *rest = name.split(".")
        arrays[name] = artifact.arrays[".".join(["module.decoder.experts", str(order[int(i)]), *rest])]
    with_one = [*latent, LATENT]
    change("probe.family_weights", lambda w: w[with_one][:, order])
    change("probe.target_weights", lambda w: w[with_one][:, order])
    for policy in ("high_level", "told_policy"):
        seen = np.concatenate([np.arange(FIELDS), FIELDS + blocks(np.arange(4 * len(order)), order)])
        change(f"{policy}.actor.net.multi_scale.projection", lambda w, seen=seen: w[seen])
        change(
            f"{policy}.actor.net.mlp.weights.0",
            lambda w, seen=seen: np.concatenate([w[: len(seen)][seen], w[len(seen) :]]),
        )
    return config, arrays


@pytest.fixture(scope="module")
def shipped():
    return load_inference(NAME)


@pytest.fixture(scope="module", params=ORDERS, ids=str)
def reordered(request, tmp_path_factory):
    """The order, and the module that was saved with it."""
    config, arrays = reordered_module(load_artifact(NAME, "inference"), request.param)
    folder = tmp_path_factory.mktemp("reordered") / NAME
    save_artifact(folder, kind="inference", config=config, weights=arrays, card="# Other\n", log="")
    return request.param, load_inference(str(folder))


def indices(module, families):
    """Those of the module, of families by the shipped module's names."""
    return np.vectorize(lambda i: module.contract.families.index(("goal", "velocity", "stand")[i]))(families)


@pytest.fixture(scope="module")
def heard(shipped):
    """Observations [decision, episode] of walks, rewarded by a task of each family."""
    rng = np.random.default_rng(0)
    x, pitch = 0.05 * rng.normal(size=(2, DECISIONS + 1, 3)).cumsum(axis=1)
    fields = {"x": x, "pitch": pitch, "vx": np.diff(x, axis=0, prepend=0) / 0.1, "pitch_rate": 0 * x}
    state = global_state(**{name: value.astype(np.float32) for name, value in fields.items()})
    target = np.array([[5.0], [-2.0], [1.0]], np.float32)
    families = np.broadcast_to(np.arange(3), x.shape)
    task = Task(families, np.broadcast_to(target, (*x.shape, 1)))
    return Observation(state, np.asarray(shipped.contract.families.reward(task, state), np.float32))


def said(agent, heard):
    """Beliefs and commands of every decision."""
    moments = [jax.tree.map(lambda leaf, i=i: leaf[i], heard) for i in range(DECISIONS + 1)]
    carry, command = begin(agent, moments[0].state)
    found = [(carry.belief, command)]
    for moment in moments[1:]:
        carry, command = decide(agent, carry, moment)
        found.append((carry.belief, command))
    return jax.tree.map(lambda *steps: np.stack(steps), *found)


def test_it_is_another_module_with_the_same_families(shipped, reordered):
    order, module = reordered
    names = shipped.contract.families.names
    assert module.contract.families.names == tuple(names[i] for i in order)
    assert module.contract.families.only(names) == shipped.contract.families
    assert tree_hash(module.parts.module) != tree_hash(shipped.parts.module)


@pytest.mark.parametrize("kind", ["reuse", "readout", "bayes"])
def test_it_believes_and_acts_the_same(shipped, reordered, heard, kind):
    order, module = reordered
    belief, command = said(build_agent(kind, shipped), heard)
    other_belief, other = said(build_agent(kind, module), heard)
    if kind == "bayes":  # before a reward all is a tie, which the order settles
        command, other = jax.tree.map(lambda leaf: leaf[1:], (command, other))
    np.testing.assert_allclose(other.action, command.action, atol=1e-4)
    assert np.ptp(command.action) > 0.1
    if kind != "reuse":  # on a point mass that has no slots
        np.testing.assert_array_equal(other.subgoal.slot, indices(module, command.subgoal.slot))
        np.testing.assert_allclose(other.subgoal.value, command.subgoal.value, atol=1e-3)
    if kind != "bayes":
        np.testing.assert_allclose(other_belief.mean, belief.mean[..., latent_order(order)], atol=1e-4)


def test_it_reads_the_same(shipped, reordered, heard):
    _, module = reordered
    moments = zip(heard.state.x[1:, 0], heard.state.pitch[1:, 0], heard.reward[1:, 0], strict=True)
    one, other = (each.begin({"x": 0.0, "pitch": 0.0}) for each in (shipped, module))
    for x, pitch, reward in moments:
        reading, again = (each.update({"x": x, "pitch": pitch}, reward) for each in (one, other))
    assert again.family == reading.family
    assert again.target == pytest.approx(reading.target, abs=1e-3)
    assert again.base_tasks == pytest.approx(reading.base_tasks, abs=1e-3)
    assert again.responsibilities == pytest.approx(reading.responsibilities, abs=1e-3)


def test_a_robot_moves_the_same(shipped, reordered, cheetah):
    """With the shipped tracker, whose commands stand in an order of their own, and the shipped classifier."""
    order, module = reordered
    slots, tracker = load_slots(f"classifier-{NAME}"), load_tracker("tracker-cheetah")
    names, latent = module.contract.families.names, latent_order(order)
    net = slots.parts.classifier.net
    classifier = SlotClassifier(
        eqx.tree_at(
            lambda n: (n.weights[0], n.weights[-1], n.biases[-1]),
            net,
            (net.weights[0][latent], net.weights[-1][:, np.array(order)], net.biases[-1][np.array(order)]),
        )
    )
    parts = eqx.tree_at(lambda p: p.classifier, slots.parts, classifier)
    other = LoadedSlots(slots.name, tree_hash(module.parts.module), names, parts)
    agents = (LiveAgent(cheetah, shipped, tracker, slots), LiveAgent(cheetah, module, tracker, other))
    batch = RobotBatch(cheetah, 1)
    batch.reset(np.random.default_rng(0))
    for _ in range(20):
        observation = np.concatenate([batch.qpos[0], batch.qvel[0]])
        reward = -abs(float(batch.qpos[0, 0]) - 5.0) / 5.0
        one, again = (agent.step(observation, reward) for agent in agents)
        np.testing.assert_allclose(again, one, atol=1e-3)
        batch.step(one[None])
    told = [(agent.inferred[0], agent.subgoal.value.tolist()) for agent in agents]
    assert told[0][0] == told[1][0]
    assert told[0][1] == pytest.approx(told[1][1], abs=1e-3)
