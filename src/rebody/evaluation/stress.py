"""Does a tracker stay on its feet? Subgoals that change at random, and pushes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.agents.controller import TrackerController
from rebody.agents.rollout import follow
from rebody.bodies import RobotSpec, Simulation, simulate
from rebody.control.command import Command, absolute
from rebody.control.places import UNBOUNDED, reachable
from rebody.control.tracker import Tracker
from rebody.types import POSE_FIELDS, Subgoal

SECONDS = 20.0
CHANGE_S = (1.0, 5.0)
"""Shortest and longest time between changes of the subgoal [s]."""
PUSH_S = (3.0, 5.0)
"""Shortest and longest time between pushes [s]."""
PUSH = 0.3
"""What a push adds to the speed of every part, one way or the other [m/s]."""


@dataclass(frozen=True)
class StressResult:
    """How a test under stress ended."""

    fell: Bool[np.ndarray, " episode"]
    ended_lying: Bool[np.ndarray, " episode"]


class Countdown:
    """Counts down to the next event of each robot."""

    def __init__(self, rng: np.random.Generator, range_s: tuple[float, float], control_dt: float, size: int):
        self._rng, self._range = rng, tuple(round(seconds / control_dt) for seconds in range_s)
        self._left = self._draw(size)

    def due(self) -> Bool[np.ndarray, " episode"]:
        """Whose event is now; counts one control step."""
        self._left -= 1
        due = self._left < 0
        self._left[due] = self._draw(int(due.sum())) - 1
        return due

    def _draw(self, size: int) -> Int[np.ndarray, " episode"]:
        return self._rng.integers(self._range[0], self._range[1] + 1, size)


def stress(tracker: Tracker, spec: RobotSpec, episodes: int, seed: int = 0, push: float = PUSH) -> StressResult:
    """Random subgoals within reach, changed every 1 to 5 s for 20 s, and a push every 3 to 5 s [m/s]: along x, or
    in any direction where the robot moves freely.
    """
    rng, batch = np.random.default_rng(seed), simulate(spec, episodes)
    batch.reset(rng)
    subgoal, fell = _subgoals(tracker, spec, batch, rng), np.zeros(episodes, bool)
    changes, pushes = (Countdown(rng, range_s, spec.control_dt, episodes) for range_s in (CHANGE_S, PUSH_S))
    controller = TrackerController(tracker, None, spec.goal_ahead)
    for _ in range(round(SECONDS / spec.control_dt)):
        is_new, fresh = changes.due(), _subgoals(tracker, spec, batch, rng)
        subgoal = Subgoal(
            np.where(is_new, fresh.slot, subgoal.slot), np.where(is_new[:, None], fresh.value, subgoal.value)
        )
        batch.push(_pushes(spec, pushes.due(), rng, push))
        follow(controller, batch, subgoal)
        fell |= batch.fallen
    return StressResult(fell, batch.fallen.copy())


def _pushes(
    spec: RobotSpec, due: Bool[np.ndarray, " episode"], rng: np.random.Generator, push: float
) -> Float[np.ndarray, "episode *axis"]:
    if not spec.floats_freely:
        return np.where(due, rng.choice([-push, push], len(due)), 0.0)
    bearing = rng.uniform(-np.pi, np.pi, len(due))
    return np.where(due[:, None], push * np.stack([np.cos(bearing), np.sin(bearing)], axis=-1), 0.0)


def _subgoals(tracker: Tracker, spec: RobotSpec, batch: Simulation, rng: np.random.Generator) -> Subgoal:
    """One of each robot, within reach of where it is."""
    families, reach = tracker.families, dict(spec.reach)
    values = np.zeros((len(families), batch.size, families.size), np.float32)
    for i, family in enumerate(families):
        box = reachable(family, reach.get(family.name))
        values[i, :, : family.size] = rng.uniform(box.low, box.high, (batch.size, family.size))
    slot = rng.integers(len(families), size=batch.size)
    # places and headings from where it is, all else as it stands
    here = batch.pose().astype(np.float32) * np.isin(POSE_FIELDS, UNBOUNDED)
    return absolute(families, Command(slot, values[slot, np.arange(batch.size)]), here)
