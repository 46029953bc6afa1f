"""The artifact that a meta-training run leaves behind, and its card."""

from pathlib import Path

import equinox as eqx

from rebody.agents.configs import InferenceSettings, ToyPolicySettings
from rebody.agents.parts import InferenceParts
from rebody.bodies.toys import Toy, describe_toy
from rebody.training.card import save
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.measure import contract_of, fit, measure_in_depth
from rebody.training.run import Run


def save_inference(parts: InferenceParts, toy: Toy, config: MetaConfig, run: Run, title: str) -> Path:
    """Fit the probe, measure, write artifact and card."""
    held_out = config.held_out_at_end
    figures = measure_in_depth(parts, toy, config, held_out)
    parts = eqx.tree_at(lambda p: p.probe, parts, fit(parts, toy, config, held_out, disturbed=True))
    contract, view = contract_of(config), config.policy_view
    settings = InferenceSettings(
        contract=contract,
        inference=config.inference,
        mixture=config.mixture if config.prior == "mixture" else None,
        high_level=ToyPolicySettings(
            view.fields, view.scales, config.sac.hidden, config.sac.projections, config.acts_by
        ),
        toy=describe_toy(toy),
        training=run.training(config),
    )
    units = {
        f"{family.name} {figure}": family.unit
        for family in config.families
        for figure in ("median", "p95", "read, disturbed")
    }
    condition = f"{held_out} held-out tasks, {config.held_out_s:g} s on the toy"
    rows = {
        name if "held-out" in name else f"{name}, {condition}": f"{value:.5g} {units.get(name, '')}".rstrip()
        for name, value in figures.items()
    }
    steps = run.iterations * config.episodes * config.decisions
    what = (
        f"Inference module (encoder, decoder, probe) and the toy's high-level policy, trained on a point mass "
        f"on {', '.join(contract.families.names)} tasks in {steps:,} toy steps. No robot took part."
    )
    return save("inference", settings, parts, run, title, what, rows)
