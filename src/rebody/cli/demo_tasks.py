"""What `rebody demo` asks of robots: hidden tasks to be measured on, and one that changes, to be filmed."""

import numpy as np

from rebody.evaluation.trial import Trial
from rebody.tasks.task_file import Switch, TaskSpec

HIDDEN_GOALS = np.linspace(2.0, 12.0, 5)
SPEEDS, SLOWEST = 5, 1.0
"""Speeds either way, from the slowest that the module learned on [m/s] to the fastest that the tracker did."""
PLACES, VELOCITIES, HEADINGS = 6, 4, 3
"""All around; places nearer and farther in turn."""
NEAR, FAR, WALK = 3.0, 8.0, 0.6
"""Distances of places [m], and a speed [m/s]."""
CHANGE_S, PLANE_CHANGE_S = 5.0, 8.0
"""When the task of the filmed episode changes [s]: early enough that every robot can come back."""


def hidden_tasks(trial: Trial) -> list[TaskSpec]:
    """All around, or front and back on the line, as far as the robot can reach in the time."""
    return _in_plane() if _is_in_plane(trial) else _on_line(trial)


def shown_task(trial: Trial) -> TaskSpec:
    """Run forward, then go back to where it began; in the plane one place, then another."""
    if _is_in_plane(trial):
        return TaskSpec("place", (-4.0, 3.0), Switch(at_s=PLANE_CHANGE_S, family="place", target=(2.0, 1.0)))
    speed = round(0.6 * _speeds(trial)[1], 2)
    return TaskSpec("velocity", (speed,), Switch(at_s=CHANGE_S, family="goal", target=(2.0,)))


def _is_in_plane(trial: Trial) -> bool:
    return "place" in trial.inference.contract.families.names


def _on_line(trial: Trial) -> list[TaskSpec]:
    slowest, fastest = _speeds(trial)
    goals = [round(float(sign * goal), 2) for sign in (-1, 1) for goal in HIDDEN_GOALS]
    both_ways = np.concatenate([np.linspace(-SLOWEST, slowest, SPEEDS), np.linspace(SLOWEST, fastest, SPEEDS)])
    tasks = [TaskSpec("goal", (goal,)) for goal in goals]
    return tasks + [TaskSpec("velocity", (round(float(speed), 2),)) for speed in both_ways]


def _in_plane() -> list[TaskSpec]:
    places = [_at(NEAR if i % 2 else FAR, angle) for i, angle in enumerate(_all_around(PLACES))]
    velocities = [_at(WALK, angle) for angle in _all_around(VELOCITIES)]
    headings = [(round(float(angle), 2),) for angle in _all_around(HEADINGS)]
    asked = {"place": places, "velocity_xy": velocities, "heading": headings}
    return [TaskSpec(family, target) for family, targets in asked.items() for target in targets]


def _all_around(size: int) -> np.ndarray:
    """Angles, none of them straight ahead [rad]."""
    return np.pi * (2 * np.arange(size) + 1) / size - np.pi


def _at(distance: float, angle: float) -> tuple[float, ...]:
    return tuple(round(float(distance * part), 2) for part in (np.cos(angle), np.sin(angle)))


def _speeds(trial: Trial) -> tuple[float, float]:
    """Slowest and fastest that the robot reaches [m/s]."""
    assert trial.robot is not None
    box = dict(trial.robot.reach)["velocity"]
    return box.low[0], box.high[0]
