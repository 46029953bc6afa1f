"""Training the bridge's classifier (thesis 6.4): binary cross-entropy per slot, on beliefs held on the toy."""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.agents.configs import ClassifierSettings
from rebody.agents.parts import Inference, SlotParts, load_inference
from rebody.agents.slots import SlotChooser, SlotClassifier, SlotOfCluster
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.nn import MLP
from rebody.ranges import check_ranges
from rebody.store import load_artifact, tree_hash
from rebody.training.card import save
from rebody.training.classifier.config import ClassifierConfig
from rebody.training.classifier.data import KNOWN_FROM, act, slots_of_clusters
from rebody.training.descent import descend
from rebody.training.inference.episodes import ToyWorld
from rebody.training.run import Metrics, Run
from rebody.types import AnyArray, Belief


class RunState(eqx.Module):
    """Everything that a resumed run needs."""

    classifier: SlotClassifier
    optimiser: optax.OptState
    iteration: Int[Array, ""]


class Beliefs(eqx.Module):
    """Beliefs of all decisions of all episodes, and whose slot was wanted."""

    belief: Belief  # [belief, latent]
    family: Int[AnyArray, " belief"]


@own_jax_settings()
def train_classifier(
    inference: str, config: ClassifierConfig, out: Path, seed: int, *, resume: bool = False, finish: bool = False
) -> Path:
    """Train a classifier and find the slots of the mixture's components; returns the artifact's folder.

    RebodyError if `out` holds another run, or the module knows one family only; Interrupted on Ctrl-C.
    """
    check_ranges(config)
    module = load_inference(inference)
    if len(module.contract.families) < 2:
        raise RebodyError(f"'{module.name}' knows one family only: there is no slot to choose.")
    with Run(out, asdict(config) | {"inference": inference, "seed": seed}, resume=resume, finish=finish) as run:
        world, key = ToyWorld.of(load_artifact(inference, "inference")), jax.random.key(seed)
        seen = listen(module, world, config, jax.random.fold_in(key, 2**31 - 1))
        state = run.restore(initial_state(module, config, key))
        state = run.loop(state, lambda state: iterate(state, seen, config, key), config.iterations, "classifier")
        return save_slots(state.classifier, module, world, config, run)


def iterate(state: RunState, seen: Beliefs, config: ClassifierConfig, key: PRNGKeyArray) -> tuple[RunState, Metrics]:
    """Some updates."""
    state, value = learn(state, seen, config, jax.random.fold_in(key, int(state.iteration)))
    return state, {"cross_entropy": float(value)}


def listen(module: Inference, world: ToyWorld, config: ClassifierConfig, key: PRNGKeyArray) -> Beliefs:
    """What the module believes in episodes of its own policy, half of them disturbed."""
    parts = []
    for i, disturbed in enumerate((False, True)):
        tasks, disturbance = world.draw(
            jax.random.fold_in(key, i), config.episodes // 2, config.decisions, config.switch_share, disturbed=disturbed
        )
        parts.append((act(module, tasks, disturbance).belief, tasks.family))
    belief, family = jax.tree.map(lambda *leaves: jnp.concatenate(leaves, axis=1), *parts)
    return Beliefs(jax.tree.map(lambda leaf: leaf.reshape(-1, leaf.shape[-1]), belief), family.ravel())


def initial_state(module: Inference, config: ClassifierConfig, key: PRNGKeyArray) -> RunState:
    """A fresh network."""
    families = module.contract.families
    net = MLP(module.parts.module.encoder.latent, len(families), config.hidden, key=key)
    classifier = SlotClassifier(net)
    return RunState(classifier, _optimiser(config).init(eqx.filter(classifier, eqx.is_array)), jnp.zeros((), jnp.int32))


@eqx.filter_jit
def learn(
    state: RunState, seen: Beliefs, config: ClassifierConfig, key: PRNGKeyArray
) -> tuple[RunState, Float[Array, ""]]:
    """Updates on beliefs drawn from all; returns the mean loss."""

    def loss(classifier: SlotClassifier, key: PRNGKeyArray):
        chosen = jax.random.randint(key, (config.batch_size,), 0, len(seen.family))
        value = cross_entropy(classifier, jax.tree.map(lambda leaf: leaf[chosen], seen))
        return value, {"cross_entropy": value}

    keys = jax.random.split(key, config.updates)
    classifier, optimiser, metrics = descend(state.classifier, state.optimiser, _optimiser(config), loss, keys)
    return RunState(classifier, optimiser, state.iteration + 1), metrics["cross_entropy"]


def cross_entropy(classifier: SlotClassifier, seen: Beliefs) -> Float[Array, ""]:
    """Binary, per slot."""
    logits = classifier.logits(seen.belief)
    return optax.sigmoid_binary_cross_entropy(logits, jax.nn.one_hot(seen.family, logits.shape[-1])).mean()


def save_slots(
    classifier: SlotClassifier, module: Inference, world: ToyWorld, config: ClassifierConfig, run: Run
) -> Path:
    """Find the slots of clusters, measure both, write artifact and card."""
    slots = np.zeros(0, np.int32)
    choosers: dict[str, SlotChooser] = {"classifier": classifier}
    if module.parts.mixture is not None:
        key = jax.random.fold_in(jax.random.key(run.settings["seed"]), 1)
        tasks, disturbance = world.draw(key, config.held_out, config.decisions, 0.0, disturbed=False)
        slots = slots_of_clusters(module, tasks, disturbance)
        choosers["clusters"] = SlotOfCluster(module.parts.mixture, slots)
    settings = ClassifierSettings(
        inference=module.name,
        inference_hash=tree_hash(module.parts.module),
        latent=module.parts.module.encoder.latent,
        families=module.contract.families.names,
        hidden=config.hidden,
        components=len(slots),
        training=run.training(config),
    )
    rows = {}
    for name, chooser in choosers.items():
        for disturbed in (False, True):
            where = "disturbed" if disturbed else "nominal"
            wrong = wrong_slots(chooser, module, world, config, disturbed=disturbed)
            rows[f"wrong slots by {name}, {where} toys, from {KNOWN_FROM} decisions on"] = f"{100 * wrong:.3f} %"
    if module.parts.mixture is not None:
        active = np.flatnonzero(np.asarray(module.parts.mixture.active))
        rows["slots of clusters"] = ", ".join(f"{k}: {module.contract.families[slots[k]].name}" for k in active)
    what = (
        f"Chooses a tracker's slot from a belief of '{module.name}': a classifier trained with labels on the toy, and "
        f"a slot for each of the mixture's components, found without labels as the one that earns most on the toy."
    )
    return save("classifier", settings, SlotParts(classifier, slots), run, f"Slots: {module.name}", what, rows)


def wrong_slots(
    chooser: SlotChooser, module: Inference, world: ToyWorld, config: ClassifierConfig, *, disturbed: bool
) -> float:
    """Share of decisions with another slot than the task's, once something can be known, on held-out tasks."""
    tasks, disturbance = world.draw(
        jax.random.key(2**31 - 1), config.held_out, config.decisions, 0.0, disturbed=disturbed
    )
    belief = act(module, tasks, disturbance).belief
    chosen = np.asarray(eqx.filter_jit(chooser)(belief))
    return float(np.mean(chosen[KNOWN_FROM:] != np.asarray(tasks.family)[KNOWN_FROM:]))


def _optimiser(config: ClassifierConfig) -> optax.GradientTransformation:
    # a run that is resumed with another length goes on along the new cosine from where its count of updates is
    return optax.adam(optax.cosine_decay_schedule(config.learning_rate, config.updates * config.iterations, alpha=0.05))
