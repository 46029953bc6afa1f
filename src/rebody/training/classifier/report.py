"""How well slots are chosen on the toy, and the artifact that a classifier's run leaves behind."""

from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from rebody.agents.configs import ClassifierSettings
from rebody.agents.parts import Inference, SlotParts
from rebody.agents.slots import SlotChooser, SlotClassifier, SlotOfCluster
from rebody.store import tree_hash
from rebody.tasks import family_names
from rebody.training.card import save
from rebody.training.classifier.config import ClassifierConfig
from rebody.training.classifier.data import KNOWN_FROM, ToyWorld, act, slots_of_clusters
from rebody.training.run import Run


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
        families=classifier.families,
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
        rows["slots of clusters"] = ", ".join(f"{k}: {family_names()[slots[k]]}" for k in active)
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
