"""What a robot's high-level policy reaches on hidden tasks, and the artifact that it leaves behind."""

from pathlib import Path

from rebody.agents.build import build_agent
from rebody.agents.configs import HighLevelSettings
from rebody.agents.controller import TrackerController
from rebody.agents.parts import Inference, LoadedTracker
from rebody.bodies import RobotSpec
from rebody.control.slot_policy import SlotPolicy
from rebody.store import tree_hash
from rebody.tasks import FAMILIES
from rebody.training.card import save
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.high_level.config import HighLevelConfig
from rebody.training.run import Run
from rebody.training.task_inference import tasks_within


def measure(
    policy: SlotPolicy, module: Inference, controller: TrackerController, spec: RobotSpec, config: HighLevelConfig
) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    agent, tasks = build_agent("retrain", module, high_level=policy), tasks_within(module, spec.reach)
    size, seconds, form = config.held_out, config.held_out_s, module.contract.reward
    return figures_of(*act(agent, controller, spec, tasks, form, size, seconds))


def save_high_level(
    policy: SlotPolicy,
    figures: dict[str, float],
    module: Inference,
    tracker: LoadedTracker,
    spec: RobotSpec,
    config: HighLevelConfig,
    run: Run,
) -> Path:
    """Write artifact and card."""
    actor = policy.actor
    settings = HighLevelSettings(
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
        training=run.training(config),
    )
    decisions = run.iterations * config.steps * config.robots
    what = (
        f"High-level policy of '{spec.name}': (global state, belief of '{module.name}') -> subgoal of "
        f"'{tracker.name}'. Trained on {decisions:,} decisions, which are {decisions * spec.steps_per_decision:,} "
        f"control steps, with {run.iterations * config.updates:,} updates; module and tracker are frozen."
    )
    rows = rows_of(figures, config.held_out, config.held_out_s)
    return save("high-level", settings, policy, run, f"High-level policy: {spec.name}", what, rows)
