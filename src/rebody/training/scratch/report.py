"""What a robot that learned everything itself reaches on hidden tasks, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import numpy as np

from rebody.agents.agent import FlatAgent
from rebody.agents.controller import ScratchController
from rebody.agents.parts import ScratchParts
from rebody.agents.rollout import Episodes, rollout_on_robot
from rebody.bodies import RobotSpec
from rebody.inference.probe import Probe, fit_probe
from rebody.store import save_artifact
from rebody.tasks import FAMILIES
from rebody.tasks.figures import final_error
from rebody.training.card import card
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
    tasks, episodes = act(parts, meta, spec, seed=0)
    family, target = tasks.family[-1], tasks.target[-1]
    errors = final_error(Task(family, target), episodes.state)
    figures = {}
    for index in meta.tasks.families:
        figures[f"{FAMILIES[index].name} median"] = float(np.median(errors[family == index]))
        figures[f"{FAMILIES[index].name} p95"] = float(np.percentile(errors[family == index], 95))
    figures["return"] = float(np.sum(episodes.reward, axis=0).mean())
    return figures | {"fell": float(np.mean(episodes.fell))}


def act(parts: ScratchParts, meta: MetaConfig, spec: RobotSpec, *, seed: int) -> tuple[Task, Episodes]:
    """Robots on held-out tasks, which are [decision, episode]."""
    task = meta.tasks.sample(jax.random.key(2**31 - 1 - seed), (TASKS,))
    tasks = jax.tree.map(lambda leaf: np.broadcast_to(leaf, (DECISIONS, TASKS)).copy(), task)
    agent = FlatAgent(inferrer=parts.module.encoder, reader=parts.probe, stride=1)
    controller = ScratchController(parts.policy, parts.module.decoder)
    return tasks, rollout_on_robot(agent, controller, spec, tasks, meta.reward, np.arange(TASKS))


def probe_of(parts: ScratchParts, meta: MetaConfig, spec: RobotSpec) -> Probe:
    """What can be read linearly from its beliefs, fitted on other tasks than figures are taken on."""
    tasks, episodes = act(parts, meta, spec, seed=1)
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
    stored = {
        "robot": spec.name,
        "contract": contract_of(meta).to_config(),
        "inference": asdict(config.inference),
        "observations": actor.observations,
        "actions": actor.actions,
        "hidden": config.sac.hidden,
        "projections": config.sac.projections,
        "training": asdict(config) | {"seed": seed, "wall_s": run.wall_s},
    }
    condition = f"{TASKS} held-out tasks, 20 s"
    rows = {}
    for index in meta.tasks.families:
        name, unit = FAMILIES[index].name, FAMILIES[index].unit
        rows[f"{name} median, {condition}"] = f"{figures[f'{name} median']:.4f} {unit}"
        rows[f"{name} 95th percentile, {condition}"] = f"{figures[f'{name} p95']:.4f} {unit}"
    rows |= {f"return, {condition}": f"{figures['return']:.1f}", "fell": f"{100 * figures['fell']:.1f} %"}
    decisions = config.iterations * config.robots * config.decisions
    what = (
        f"Inference module and joint policy of '{spec.name}', learned together on the robot: nothing is reused. "
        f"Trained on {decisions * spec.steps_per_decision:,} control steps with "
        f"{config.iterations * config.policy_updates:,} updates of the policy and "
        f"{config.iterations * config.inference_updates:,} of the module."
    )
    text = card(f"From scratch: {spec.name}", what, run, seed, rows)
    return save_artifact(run.out, kind="scratch", config=stored, weights=parts, card=text, log=run.log)
