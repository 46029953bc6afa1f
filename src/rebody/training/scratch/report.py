"""What a robot that learned everything itself reaches on hidden tasks, and the artifact that it leaves behind."""

from pathlib import Path

import equinox as eqx

from rebody.agents.agent import FlatAgent
from rebody.agents.configs import ScratchSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import ScratchParts
from rebody.agents.rollout import Episodes
from rebody.bodies import RobotSpec
from rebody.training.card import save
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.inference.measure import contract_of, probe_of
from rebody.training.run import Run
from rebody.training.scratch.config import ScratchConfig
from rebody.types import Task


def measure(parts: ScratchParts, config: ScratchConfig, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    return figures_of(*act_on(parts, config, spec, seed=0))


def act_on(parts: ScratchParts, config: ScratchConfig, spec: RobotSpec, *, seed: int) -> tuple[Task, Episodes]:
    """Robots on held-out tasks."""
    agent = FlatAgent(inferrer=parts.module.encoder, reader=parts.probe, stride=1)
    controller, meta = FlatController(parts.policy, parts.module.decoder), config.meta(spec.reach)
    return act(agent, controller, spec, meta.tasks, meta.reward, config.held_out, config.held_out_s, seed)


def save_scratch(parts: ScratchParts, spec: RobotSpec, config: ScratchConfig, run: Run) -> Path:
    """Measure, fit the probe on other tasks, write artifact and card."""
    figures = measure(parts, config, spec)
    parts = eqx.tree_at(lambda p: p.probe, parts, probe_of(*act_on(parts, config, spec, seed=1)))
    actor = parts.policy.actor
    settings = ScratchSettings(
        robot=spec.name,
        contract=contract_of(config.meta(spec.reach)),
        inference=config.inference,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    rows = rows_of(figures, config.held_out, config.held_out_s)
    decisions = run.iterations * config.robots * config.decisions
    what = (
        f"Inference module and joint policy of '{spec.name}', learned together on the robot: nothing is reused. "
        f"Trained on {decisions * spec.steps_per_decision:,} control steps with "
        f"{run.iterations * config.policy_updates:,} updates of the policy and "
        f"{run.iterations * config.inference_updates:,} of the module."
    )
    return save("scratch", settings, parts, run, f"From scratch: {spec.name}", what, rows)
