"""What a robot that learned everything itself reaches on hidden tasks, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from rebody.agents.agent import FlatAgent
from rebody.agents.configs import ScratchSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import ScratchParts
from rebody.agents.rollout import Episodes
from rebody.bodies import RobotSpec
from rebody.inference.probe import Probe, fit_probe
from rebody.store import save_artifact
from rebody.training.card import card
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.measure import PROBED_FROM, contract_of
from rebody.training.run import Run
from rebody.training.scratch.config import ScratchConfig
from rebody.types import Task

TASKS = 100
"""Held-out tasks."""
DECISIONS = 200


def measure(parts: ScratchParts, meta: MetaConfig, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    return figures_of(*act_on(parts, meta, spec, seed=0))


def act_on(parts: ScratchParts, meta: MetaConfig, spec: RobotSpec, *, seed: int) -> tuple[Task, Episodes]:
    """Robots on held-out tasks."""
    agent = FlatAgent(inferrer=parts.module.encoder, reader=parts.probe, stride=1)
    controller = FlatController(parts.policy, parts.module.decoder)
    return act(agent, controller, spec, meta.tasks, meta.reward, (DECISIONS, TASKS), seed)


def probe_of(parts: ScratchParts, meta: MetaConfig, spec: RobotSpec) -> Probe:
    """What can be read linearly from its beliefs, fitted on other tasks than figures are taken on."""
    tasks, episodes = act_on(parts, meta, spec, seed=1)
    latent = np.asarray(episodes.belief.mean)[PROBED_FROM:]
    heard = jax.tree.map(lambda leaf: leaf[PROBED_FROM:].ravel(), tasks)
    return fit_probe(latent.reshape(-1, latent.shape[-1]), heard.family, heard.target)


def save_scratch(
    parts: ScratchParts, spec: RobotSpec, config: ScratchConfig, meta: MetaConfig, run: Run, seed: int
) -> Path:
    """Fit the probe, measure, write artifact and card."""
    figures = measure(parts, meta, spec)
    parts = eqx.tree_at(lambda p: p.probe, parts, probe_of(parts, meta, spec))
    actor = parts.policy.actor
    stored = ScratchSettings(
        robot=spec.name,
        contract=contract_of(meta),
        inference=config.inference,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=asdict(config) | run.length | {"seed": seed, "wall_s": run.wall_s},
    )
    rows = rows_of(figures, f"{TASKS} held-out tasks, 20 s")
    decisions = run.iterations * config.robots * config.decisions
    what = (
        f"Inference module and joint policy of '{spec.name}', learned together on the robot: nothing is reused. "
        f"Trained on {decisions * spec.steps_per_decision:,} control steps with "
        f"{run.iterations * config.policy_updates:,} updates of the policy and "
        f"{run.iterations * config.inference_updates:,} of the module."
    )
    text = card(f"From scratch: {spec.name}", what, run, seed, rows)
    return save_artifact(run.out, kind="scratch", config=asdict(stored), weights=parts, card=text, log=run.log)
