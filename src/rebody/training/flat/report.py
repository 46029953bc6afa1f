"""What a flat policy reaches on hidden tasks, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

import numpy as np

from rebody.agents.build import build_agent
from rebody.agents.controller import FlatController
from rebody.agents.parts import Inference
from rebody.agents.rollout import rollout_on_robot
from rebody.bodies import RobotSpec
from rebody.control.flat import FlatPolicy
from rebody.store import save_artifact, tree_hash
from rebody.tasks import family_index
from rebody.tasks.figures import final_error
from rebody.training.card import card
from rebody.training.flat.config import FlatConfig
from rebody.training.run import Run
from rebody.types import Task

TASKS = 100
"""Held-out tasks."""
DECISIONS = 200


def measure(policy: FlatPolicy, module: Inference, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of the module's first family, return, share that fell."""
    name, (low, high) = next(iter(module.contract.target_ranges.items()))
    target = np.random.default_rng(2**31 - 1).uniform(low, high, TASKS).astype(np.float32)
    shape = (DECISIONS, TASKS)
    tasks = Task(np.full(shape, family_index(name), np.int32), np.broadcast_to(target, shape).copy())
    agent, seeds = build_agent("flat", module), np.arange(TASKS)
    episodes = rollout_on_robot(agent, FlatController(policy), spec, tasks, module.contract.reward, seeds)
    errors = final_error(Task(tasks.family[-1], target), episodes.state)
    return {
        "median error": float(np.median(errors)),
        "p95 error": float(np.percentile(errors, 95)),
        "return": float(np.sum(episodes.reward, axis=0).mean()),
        "fell": float(np.mean(episodes.fell)),
    }


def save_flat(policy: FlatPolicy, module: Inference, spec: RobotSpec, config: FlatConfig, run: Run, seed: int) -> Path:
    """Measure, write artifact and card."""
    figures = measure(policy, module, spec)
    actor = policy.actor
    stored = {
        "robot": spec.name,
        "inference": module.name,
        "inference_hash": tree_hash(module.parts.module),
        "reach": policy.reach,
        "observations": actor.observations,
        "actions": actor.actions,
        "hidden": config.sac.hidden,
        "projections": config.sac.projections,
        "training": asdict(config) | {"seed": seed, "wall_s": run.wall_s},
    }
    condition = f"{TASKS} held-out tasks, 20 s"
    rows = {
        f"median final error, {condition}": f"{figures['median error']:.4f}",
        f"95th percentile, {condition}": f"{figures['p95 error']:.4f}",
        f"return, {condition}": f"{figures['return']:.1f}",
        "fell": f"{100 * figures['fell']:.1f} %",
    }
    steps = config.iterations * config.steps * config.robots
    what = (
        f"Flat policy of '{spec.name}': (joint state, x, belief of '{module.name}') -> joint action, without "
        f"subgoals. Trained on {steps:,} control steps with {config.iterations * config.updates:,} updates."
    )
    text = card(f"Flat policy: {spec.name}", what, run, seed, rows)
    return save_artifact(run.out, kind="flat", config=stored, weights=policy, card=text, log=run.log)
