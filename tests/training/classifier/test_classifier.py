"""Choosing slots is learned on the toy alone, and what was learned can be loaded and goes on after a stop."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.agents.build import slot_chooser
from rebody.agents.parts import load_inference, load_slots
from rebody.bodies.disturbance import Randomisation
from rebody.cli.main import run
from rebody.store import load_artifact, tree_hash
from rebody.training.classifier import ClassifierConfig
from rebody.training.classifier.train import Beliefs, cross_entropy, initial_state, iterate
from rebody.training.inference.episodes import ToyWorld
from rebody.types import Belief

GOAL, VELOCITY, STAND = range(3)
FLAGS = "--episodes 4 --decisions 30 --held-out 6 --iterations 3 --updates 2 --batch-size 8 --hidden 4"


@pytest.fixture(scope="module")
def folder(full_module, tmp_path_factory):
    out = tmp_path_factory.mktemp("slots") / "classifier"
    assert run(["train", "classifier", "--inference", str(full_module), "--out", str(out), *FLAGS.split()]) == 0
    return out


@pytest.fixture(scope="module")
def module(full_module):
    return load_inference(str(full_module))


def test_what_was_trained_serves_the_module(folder, module):
    loaded = load_slots(str(folder))
    assert loaded.families == ("goal", "velocity", "stand")
    assert loaded.parts.of_cluster.shape == module.parts.mixture.active.shape
    assert set(np.asarray(loaded.parts.of_cluster)) <= {GOAL, VELOCITY, STAND}
    assert slot_chooser(module, loaded, "classifier") is loaded.parts.classifier
    card = (folder / "card.md").read_text()
    assert "wrong slots by classifier, disturbed toys" in card
    assert "wrong slots by clusters, nominal toys" in card


def test_the_same_seed_gives_the_same_artifact(folder, full_module, tmp_path):
    out = tmp_path / "again"
    assert run(["train", "classifier", "--inference", str(full_module), "--out", str(out), *FLAGS.split()]) == 0
    assert tree_hash(load_slots(str(out)).parts) == tree_hash(load_slots(str(folder)).parts)


def test_a_module_of_one_family_needs_none(own_module, tmp_path, capsys):
    out = tmp_path / "none"
    assert run(["train", "classifier", "--inference", str(own_module), "--out", str(out)]) == 2
    assert "knows one family only" in capsys.readouterr().err
    assert not out.exists()


def test_the_world_is_the_modules_own(full_module):
    world = ToyWorld.of(load_artifact(str(full_module), "inference"))
    assert world.randomisation == Randomisation()
    assert world.families.names == ("goal", "velocity", "stand")
    tasks, disturbance = world.draw(jax.random.key(0), 50, 200, 0.0, disturbed=True)
    assert tasks.target.shape == (200, 50, 1)
    assert np.abs(tasks.target[tasks.family == GOAL]).min() >= 2.0
    assert float(disturbance.ripple_amplitude.max()) > 0.3
    _, calm = world.draw(jax.random.key(0), 50, 200, 0.0, disturbed=False)
    assert not np.asarray(calm.ripple_amplitude).any()


def test_what_can_be_told_apart_is_learned(module):
    """Beliefs whose first number says the family."""
    config = ClassifierConfig(updates=50, batch_size=64)
    family = jnp.arange(300) % 3
    mean = jax.random.normal(jax.random.key(0), (300, module.parts.module.encoder.latent)).at[:, 0].set(3.0 * family)
    seen = Beliefs(Belief(mean, jnp.ones_like(mean)), family)
    state = initial_state(module, config, jax.random.key(1))
    before = cross_entropy(state.classifier, seen)
    for _ in range(6):
        state, _ = iterate(state, seen, config, jax.random.key(2))
    assert cross_entropy(state.classifier, seen) < 0.2 * before
    assert np.mean(state.classifier(seen.belief) == family) > 0.97
