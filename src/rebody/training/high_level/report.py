"""What a robot's high-level policy reaches on hidden tasks, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

from rebody.agents.build import build_agent
from rebody.agents.configs import HighLevelSettings
from rebody.agents.controller import TrackerController
from rebody.agents.parts import Inference, LoadedTracker
from rebody.bodies import RobotSpec
from rebody.control.slot_policy import SlotPolicy
from rebody.store import save_artifact, tree_hash
from rebody.tasks import FAMILIES
from rebody.training.card import card
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.high_level.config import HighLevelConfig
from rebody.training.minds import tasks_within
from rebody.training.run import Run

TASKS = 100
"""Held-out tasks."""
DECISIONS = 200


def measure(policy: SlotPolicy, module: Inference, controller: TrackerController, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    agent, tasks = build_agent("retrain", module, high_level=policy), tasks_within(module, spec.reach)
    return figures_of(*act(agent, controller, spec, tasks, module.contract.reward, (DECISIONS, TASKS)))


def save_high_level(
    policy: SlotPolicy,
    module: Inference,
    tracker: LoadedTracker,
    spec: RobotSpec,
    config: HighLevelConfig,
    run: Run,
    seed: int,
) -> Path:
    """Measure, write artifact and card."""
    figures = measure(policy, module, TrackerController(tracker.tracker, spec.goal_ahead), spec)
    actor = policy.actor
    stored = HighLevelSettings(
        robot=spec.name,
        inference=module.name,
        inference_hash=tree_hash(module.parts.module),
        tracker=tracker.name,
        tracker_hash=tree_hash(tracker.tracker),
        view=policy.view,
        slots={FAMILIES[family].name: scale for family, scale in policy.slots},
        observations=actor.observations,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=asdict(config) | run.length | {"seed": seed, "wall_s": run.wall_s},
    )
    rows = rows_of(figures, f"{TASKS} held-out tasks, 20 s")
    decisions = run.iterations * config.steps * config.robots
    what = (
        f"High-level policy of '{spec.name}': (global state, belief of '{module.name}') -> subgoal of "
        f"'{tracker.name}'. Trained on {decisions:,} decisions, which are {decisions * spec.steps_per_decision:,} "
        f"control steps, with {run.iterations * config.updates:,} updates; module and tracker are frozen."
    )
    text = card(f"High-level policy: {spec.name}", what, run, seed, rows)
    return save_artifact(run.out, kind="high-level", config=asdict(stored), weights=policy, card=text, log=run.log)
