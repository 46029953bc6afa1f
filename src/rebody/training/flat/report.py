"""What a flat policy reaches on hidden tasks, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

from rebody.agents.build import build_agent
from rebody.agents.configs import FlatSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import Inference
from rebody.bodies import RobotSpec
from rebody.control.flat import FlatPolicy
from rebody.store import save_artifact, tree_hash
from rebody.training.card import card
from rebody.training.flat.config import FlatConfig
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.minds import tasks_within
from rebody.training.run import Run

TASKS = 100
"""Held-out tasks."""
DECISIONS = 200


def measure(policy: FlatPolicy, module: Inference, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    controller = FlatController(policy, module.parts.module.decoder)
    tasks = tasks_within(module, spec.reach)
    agent, form = build_agent("flat", module), module.contract.reward
    return figures_of(*act(agent, controller, spec, tasks, form, (DECISIONS, TASKS)))


def save_flat(policy: FlatPolicy, module: Inference, spec: RobotSpec, config: FlatConfig, run: Run, seed: int) -> Path:
    """Measure, write artifact and card."""
    figures = measure(policy, module, spec)
    actor = policy.actor
    stored = FlatSettings(
        robot=spec.name,
        inference=module.name,
        inference_hash=tree_hash(module.parts.module),
        reach=policy.view.reach,
        places=policy.view.places,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=asdict(config) | run.length | {"seed": seed, "wall_s": run.wall_s},
    )
    condition = f"{TASKS} held-out tasks, 20 s"
    rows = rows_of(figures, condition)
    steps = run.iterations * config.steps * config.robots
    what = (
        f"Flat policy of '{spec.name}': (joint state, x, belief of '{module.name}') -> joint action, without "
        f"subgoals. Trained on {steps:,} control steps with {run.iterations * config.updates:,} updates."
    )
    text = card(f"Flat policy: {spec.name}", what, run, seed, rows)
    return save_artifact(run.out, kind="flat", config=asdict(stored), weights=policy, card=text, log=run.log)
