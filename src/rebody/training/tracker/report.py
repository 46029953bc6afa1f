"""What a tracker does that is told the truth, and the artifact that it leaves behind."""

from collections.abc import Callable
from pathlib import Path

import jax
import numpy as np
from jaxtyping import Bool, Float

from rebody.agents.configs import TrackerSettings
from rebody.agents.controller import TrackerController
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.robot import Reach
from rebody.control.tracker import Tracker
from rebody.tasks import FAMILIES, GOAL, VELOCITY, family_index
from rebody.training.card import save
from rebody.training.held_out import errors_of
from rebody.training.motion import decision
from rebody.training.run import Run
from rebody.training.tracker.config import TrackerConfig
from rebody.types import DECISION_DT, GlobalState, Subgoal, Task

SLOWEST = 0.3
"""Speeds below this are not asked for [m/s]."""


def measure(tracker: Tracker, spec: RobotSpec, config: TrackerConfig) -> dict[str, float]:
    """Errors on held-out commands of each slot within reach, speed at a zero command, share that fell."""
    rng, reach, size = np.random.default_rng(2**31 - 1), tracker.reach, config.held_out
    values = [
        speeds_within(reach, size, rng) if name == "velocity" else rng.uniform(*ends, size)
        for name, ends in reach.limits.items()
    ]
    slot = np.repeat([family_index(name) for name in reach.limits], size)
    zeros = np.zeros(max(1, size // 4))
    command = Subgoal(
        np.concatenate([slot, np.full(len(zeros), GOAL), np.full(len(zeros), VELOCITY)]).astype(np.int32),
        np.concatenate([*values, zeros, zeros]).astype(np.float32),
    )
    controller = TrackerController(tracker)
    states, fell = run_robots(
        spec, len(command.slot), lambda batch: follow(controller, batch, command), config.held_out_s
    )
    asked, moved = jax.tree.map(lambda leaf: leaf[..., : len(slot)], (Task(command.slot, command.value), states))
    figures = errors_of(asked, moved)
    figures["zero speed"] = float(np.abs(states.vx[-10:, len(slot) :]).mean())  # in the last second
    return figures | {"fell": float(fell.mean())}


def speeds_within(reach: Reach, size: int, rng: np.random.Generator) -> Float[np.ndarray, " size"]:
    """Speeds that may be asked for, none of them close to zero [m/s]."""
    slowest, fastest = reach.speed
    both_ways = ((slowest, min(-SLOWEST, fastest)), (max(SLOWEST, slowest), fastest))
    ranges = [ends for ends in both_ways if ends[0] < ends[1]] or [(slowest, fastest)]
    lengths = np.array([high - low for low, high in ranges])
    which = rng.choice(len(ranges), size, p=lengths / lengths.sum())
    low, high = np.array(ranges)[which].T
    return rng.uniform(low, high)


def run_robots(
    spec: RobotSpec, size: int, control_step: Callable[[RobotBatch], None], seconds: float = 10.0
) -> tuple[GlobalState, Bool[np.ndarray, " robot"]]:
    """States after each decision, [decision, robot], and which robots fell, moved by whatever does a control step."""
    batch = RobotBatch(spec, size)
    batch.reset(np.random.default_rng(0))
    decisions = [decision(batch, lambda _: control_step(batch)) for _ in range(round(seconds / DECISION_DT))]
    states, fell = zip(*decisions, strict=True)
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states), np.any(fell, axis=0)


def save_tracker(tracker: Tracker, figures: dict[str, float], spec: RobotSpec, config: TrackerConfig, run: Run) -> Path:
    """Write artifact and card."""
    actor, reach = tracker.actor, tracker.reach
    settings = TrackerSettings(
        robot=spec.name,
        control_dt=spec.control_dt,
        reach=reach,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    condition = f"{config.held_out} held-out commands, {config.held_out_s:g} s"
    asked = {
        "goal": f"goals to +-{reach.distance:g} m",
        "velocity": f"speeds {_ends(reach.speed)} m/s beyond +-{SLOWEST:g}",
        "stand": f"pitches {_ends(reach.pitch)} rad",
        "jump": f"jumps {_ends(reach.jump)} m/s",
    }
    rows = {
        f"{asked[name]}, {figure}, {condition}": f"{figures[f'{name} {key}']:.4f} {FAMILIES[family_index(name)].unit}"
        for name in tracker.slots
        for key, figure in (("median", "median error"), ("p95", "95th percentile"))
    }
    rows |= {
        "zero command: mean speed in the last second": f"{figures['zero speed']:.4f} m/s",
        "fell": f"{100 * figures['fell']:.1f} %",
    }
    steps = run.iterations * config.steps * config.robots
    updates = run.iterations * config.updates
    what = (
        f"Low-level policy of '{spec.name}' with the slots {', '.join(tracker.slots)}: (joint state, subgoal) -> "
        f"joint action. Trained on {steps:,} control steps with {updates:,} updates."
    )
    return save("tracker", settings, tracker, run, f"Tracker: {spec.name}", what, rows)


def _ends(ends: tuple[float, float] | None) -> str:
    return f"[{ends[0]:g}, {ends[1]:g}]" if ends else ""
