"""What a tracker does that is told the truth, and the artifact that it leaves behind."""

from dataclasses import asdict
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Bool

from rebody.agents.controller import TrackerController
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, RobotSpec
from rebody.control.tracker import SLOTS, Tracker
from rebody.store import save_artifact
from rebody.tasks import GOAL, VELOCITY
from rebody.tasks.figures import final_error
from rebody.training.card import card
from rebody.training.run import Run
from rebody.training.tracker.config import TrackerConfig
from rebody.types import DECISION_DT, GlobalState, Subgoal, Task

COMMANDS = 100
"""Held-out commands per slot."""
SECONDS = 10.0
GOALS = (-5.0, 5.0)
SPEEDS = (1.0, 3.0)


def measure(tracker: Tracker, spec: RobotSpec) -> dict[str, float]:
    """Errors on goals to +-5 m and speeds of +-[1, 3] m/s, speed at a zero command, share that fell."""
    rng = np.random.default_rng(2**31 - 1)
    goals = rng.uniform(*GOALS, COMMANDS)
    speeds = rng.uniform(*SPEEDS, COMMANDS) * rng.choice([-1, 1], COMMANDS)
    zeros = np.zeros(COMMANDS // 4)
    slot = np.repeat([GOAL, VELOCITY, GOAL, VELOCITY], [COMMANDS, COMMANDS, len(zeros), len(zeros)])
    value = np.concatenate([goals, speeds, zeros, zeros])
    command = Subgoal(slot.astype(np.int32), value.astype(np.float32))
    states, fell = _run(tracker, spec, command)
    errors = final_error(Task(command.slot, command.value), states)[: 2 * COMMANDS].reshape(2, COMMANDS)
    last_second = states.vx[-10:, 2 * COMMANDS :]
    return {
        "goal median": float(np.median(errors[0])),
        "goal p95": float(np.percentile(errors[0], 95)),
        "velocity median": float(np.median(errors[1])),
        "velocity p95": float(np.percentile(errors[1], 95)),
        "zero speed": float(np.abs(last_second).mean()),
        "fell": float(fell.mean()),
    }


def _run(tracker: Tracker, spec: RobotSpec, command: Subgoal) -> tuple[GlobalState, Bool[np.ndarray, " robot"]]:
    """States after each decision, [decision, robot], and which robots fell."""
    batch = RobotBatch(spec, len(command.slot))
    batch.reset(np.random.default_rng(0))
    states, fell = [], np.zeros(len(command.slot), bool)
    for _ in range(round(SECONDS / DECISION_DT)):
        before = batch.qpos.copy()
        for _ in range(spec.steps_per_decision):
            follow(TrackerController(tracker), batch, command)
            fell |= batch.fallen
        states.append(spec.observe(batch.qpos, before))
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states), fell


def save_tracker(tracker: Tracker, spec: RobotSpec, config: TrackerConfig, run: Run, seed: int) -> Path:
    """Measure, write artifact and card."""
    figures = measure(tracker, spec)
    actor = tracker.actor
    stored = {
        "robot": spec.name,
        "slots": SLOTS,
        "control_dt": spec.control_dt,
        "max_distance": tracker.max_distance,
        "max_speed": tracker.max_speed,
        "observations": actor.observations,
        "actions": actor.actions,
        "hidden": config.sac.hidden,
        "projections": config.sac.projections,
        "training": asdict(config) | {"seed": seed, "wall_s": run.wall_s},
    }
    condition = f"{COMMANDS} held-out commands, {SECONDS:g} s"
    rows = {
        f"goals to +-5 m, median error, {condition}": f"{figures['goal median']:.4f} m",
        f"goals to +-5 m, 95th percentile, {condition}": f"{figures['goal p95']:.4f} m",
        f"speeds +-[1, 3] m/s, median error, {condition}": f"{figures['velocity median']:.4f} m/s",
        f"speeds +-[1, 3] m/s, 95th percentile, {condition}": f"{figures['velocity p95']:.4f} m/s",
        "zero command: mean speed in the last second": f"{figures['zero speed']:.4f} m/s",
        "fell": f"{100 * figures['fell']:.1f} %",
    }
    steps = config.iterations * config.steps * config.robots
    updates = config.iterations * config.updates
    what = (
        f"Low-level policy of '{spec.name}' with the slots {' and '.join(SLOTS)}: (joint state, subgoal) -> "
        f"joint action. Trained on {steps:,} control steps with {updates:,} updates."
    )
    return save_artifact(
        run.out,
        kind="tracker",
        config=stored,
        weights=tracker,
        card=card(f"Tracker: {spec.name}", what, run, seed, rows),
        log=run.log,
    )
