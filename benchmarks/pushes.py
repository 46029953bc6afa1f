"""Robots that walk by their makers' policies, pushed by 0.5 m/s from any side every 3 to 5 s, and a hidden task each.

    .venv/bin/python benchmarks/pushes.py [go1 ...] [--push 0.5] [--tasks 24]

Needs REBODY_MAKERS (docs/walking-robots.md). Errors of the last 2 s, and falls. Beside `reuse` the oracle, which is
told the task, and idle, under pushes of the same kind.
"""

import argparse
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from rebody.agents.parts import load_inference, load_tracker
from rebody.bodies import Simulation, load_robot
from rebody.evaluation.evaluate import Yardsticks, evaluate
from rebody.evaluation.stress import PUSH_S, Countdown
from rebody.evaluation.tables import summary_table
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import read_tasks
from rebody.types import Subgoal

ROOT = Path(__file__).parents[1]
TASKS = {"go1": "plane-go1.json"}
SECONDS = 40.0


@dataclass
class Pushes:
    """What happens to the bodies at each control step."""

    size: float
    """Change of the speed of every part [m/s]."""
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(0))
    countdown: Countdown | None = None

    def __call__(self, body: Simulation, subgoal: Subgoal) -> None:
        """Push those whose turn it is."""
        self.countdown = self.countdown or Countdown(self.rng, PUSH_S, body.step_s, body.size)
        angle = self.rng.uniform(-np.pi, np.pi, body.size)
        change = self.size * np.column_stack([np.cos(angle), np.sin(angle)])
        body.push(change * self.countdown.due()[:, None])


def main() -> None:
    """A table for each robot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("robots", nargs="*", default=["go1", "t1", "berkeley", "g1"])
    parser.add_argument("--push", type=float, default=0.5)
    parser.add_argument("--tasks", type=int, default=24)
    said = parser.parse_args()
    for name in said.robots:
        trial = Trial(
            agent="reuse",
            inference=load_inference("plane"),
            families=SHIPPED,
            robot=load_robot(str(ROOT / "examples" / "walking" / f"{name}.toml")),
            tracker=load_tracker("navigator"),
            slots_by="belief",
            sharpen=True,
            seconds=SECONDS,
        )
        specs = read_tasks(ROOT / "benchmarks" / "tasks" / TASKS.get(name, "plane-humanoids.json"), SHIPPED)
        trials = [replace(trial, agent=agent, on_frame=Pushes(said.push)) for agent in ("reuse", "oracle", "idle")]
        shown = [evaluate(each, specs[: said.tasks], 1, Yardsticks(None, None)) for each in trials]
        table: Table = summary_table(shown)
        table.title = f"{name}, pushed by {said.push:g} m/s every {PUSH_S[0]:g} to {PUSH_S[1]:g} s"
        Console().print(table)


if __name__ == "__main__":
    main()
