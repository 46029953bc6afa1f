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
from rebody.control.tracker import Tracker
from rebody.ranges import Box
from rebody.tasks import Family
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
    rng, families, size = np.random.default_rng(2**31 - 1), tracker.families, config.held_out
    asked = [_held_out(family, size, rng) for family in families]
    still = [np.zeros((max(1, size // 4), family.size)) for family in families if _is_standstill(family)]
    slots = [*range(len(families)), *(i for i, family in enumerate(families) if _is_standstill(family))]
    values = [*asked, *still]
    command = Subgoal(
        np.repeat(slots, [len(value) for value in values]).astype(np.int32),
        np.concatenate([families.pad(value) for value in values]).astype(np.float32),
    )
    controller = TrackerController(tracker)
    states, fell = run_robots(
        spec, len(command.slot), lambda batch: follow(controller, batch, command), config.held_out_s
    )
    told = len(families) * size
    task, moved = jax.tree.map(lambda leaf: leaf[:told], Task(command.slot, command.value)), _of_robots(states, told)
    figures = errors_of(families, task, moved)
    if still:
        figures["zero speed"] = float(np.hypot(states.vx, states.vy)[-10:, told:].mean())  # in the last second
    return figures | {"fell": float(fell.mean())}


def _of_robots(states: GlobalState, first: int) -> GlobalState:
    """The first of them; states are [decision, robot]."""
    return jax.tree.map(lambda leaf: leaf[:, :first], states)


def _is_standstill(family: Family) -> bool:
    """Whether a command of zero asks to stand where the robot is."""
    return set(family.quantity.components) <= {"x", "y", "vx", "vy"}


def _held_out(family: Family, size: int, rng: np.random.Generator) -> Float[np.ndarray, "command size"]:
    """Commands within reach; of speeds along x none close to zero."""
    if family.quantity.components == ("vx",):
        return speeds_within(family.range, size, rng)[:, None]
    return rng.uniform(family.range.low, family.range.high, (size, family.size))


def speeds_within(reach: Box, size: int, rng: np.random.Generator) -> Float[np.ndarray, " size"]:
    """Speeds that may be asked for, none of them close to zero [m/s]."""
    (slowest,), (fastest,) = reach.low, reach.high
    both_ways = ((slowest, min(-SLOWEST, fastest)), (max(SLOWEST, slowest), fastest))
    ranges = [ends for ends in both_ways if ends[0] < ends[1]] or [(slowest, fastest)]
    lengths = np.array([high - low for low, high in ranges])
    which = rng.choice(len(ranges), size, p=lengths / lengths.sum())
    low, high = np.array(ranges)[which].T
    return rng.uniform(low, high)


def run_robots(
    spec: RobotSpec, size: int, control_step: Callable[[RobotBatch], object], seconds: float = 10.0
) -> tuple[GlobalState, Bool[np.ndarray, " robot"]]:
    """States after each decision, [decision, robot], and which robots fell, moved by whatever does a control step."""
    batch = RobotBatch(spec, size)
    batch.reset(np.random.default_rng(0))
    decisions = [decision(batch, lambda _: control_step(batch)) for _ in range(round(seconds / DECISION_DT))]
    states, fell = zip(*decisions, strict=True)
    return jax.tree.map(lambda *leaves: np.stack(leaves), *states), np.any(fell, axis=0)


def save_tracker(tracker: Tracker, figures: dict[str, float], spec: RobotSpec, config: TrackerConfig, run: Run) -> Path:
    """Write artifact and card."""
    actor, families = tracker.actor, tracker.families
    settings = TrackerSettings(
        robot=spec.name,
        control_dt=spec.control_dt,
        families=families,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    condition = f"{config.held_out} held-out commands, {config.held_out_s:g} s"
    rows = {
        f"{_asked(family)}, {figure}, {condition}": f"{figures[f'{family.name} {key}']:.4f} {family.unit}"
        for family in families
        for key, figure in (("median", "median error"), ("p95", "95th percentile"))
    }
    if "zero speed" in figures:
        rows["zero command: mean speed in the last second"] = f"{figures['zero speed']:.4f} m/s"
    rows["fell"] = f"{100 * figures['fell']:.1f} %"
    steps = run.iterations * config.steps * config.robots
    updates = run.iterations * config.updates
    what = (
        f"Low-level policy of '{spec.name}' with the slots {', '.join(families.names)}: (joint state, subgoal) -> "
        f"joint action. Trained on {steps:,} control steps with {updates:,} updates."
    )
    return save("tracker", settings, tracker, run, f"Tracker: {spec.name}", what, rows)


def _asked(family: Family) -> str:
    """What was asked for, in words."""
    box = family.range
    ends = " x ".join(f"[{low:g}, {high:g}]" for low, high in zip(box.low, box.high, strict=True))
    slow = f" beyond +-{SLOWEST:g}" if family.quantity.components == ("vx",) else ""
    return f"{family.name} in {ends} {family.unit}{slow}"
