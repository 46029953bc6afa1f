"""The artifact that a meta-training run leaves behind, and its card."""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx

from rebody.agents.configs import InferenceSettings, ToyPolicySettings
from rebody.agents.parts import InferenceParts
from rebody.bodies.toys import Toy, describe_toy
from rebody.store import save_artifact
from rebody.tasks import FAMILIES
from rebody.training.card import card
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.measure import contract_of, fit, measure_in_depth
from rebody.training.run import Run

HELD_OUT = 500
"""Held-out tasks of a card's figures."""


def save_inference(parts: InferenceParts, toy: Toy, config: MetaConfig, run: Run, seed: int, title: str) -> Path:
    """Fit the probe, measure, write artifact and card."""
    figures = measure_in_depth(parts, toy, config, HELD_OUT)
    parts = eqx.tree_at(lambda p: p.probe, parts, fit(parts, toy, config, HELD_OUT, disturbed=True))
    contract, view = contract_of(config), config.policy_view
    stored = InferenceSettings(
        contract=contract,
        inference=config.inference,
        mixture=config.mixture if config.prior == "mixture" else None,
        high_level=ToyPolicySettings(view.fields, view.scales, config.sac.hidden, config.sac.projections),
        toy=describe_toy(toy),
        training=asdict(config) | run.length | {"seed": seed, "wall_s": run.wall_s},
    )
    units = {
        f"{family.name} {figure}": family.unit for family in FAMILIES for figure in ("median", "p95", "read, disturbed")
    }
    rows = {
        f"{name}, {HELD_OUT} held-out tasks, 20 s on the toy": f"{value:.5g} {units.get(name, '')}".rstrip()
        for name, value in figures.items()
    }
    steps = run.iterations * config.episodes * config.decisions
    what = (
        f"Inference module (encoder, decoder, probe) and the toy's high-level policy, trained on a point mass "
        f"on {', '.join(contract.target_ranges)} tasks in {steps:,} toy steps. No robot took part."
    )
    text = card(title, what, run, seed, rows)
    return save_artifact(run.out, kind="inference", config=asdict(stored), weights=parts, card=text, log=run.log)
