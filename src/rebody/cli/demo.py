"""`rebody demo`: the main job on the shipped artifacts."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from rebody.bodies import shipped_robots
from rebody.cli.output import check_output
from rebody.cli.run import describe, shoot
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import Results, evaluate, save_results, summary_table
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.evaluate import take_yardsticks
from rebody.evaluation.trial import Trial
from rebody.report import plot_episode, plot_transfer
from rebody.report.page.tables import vector
from rebody.store import shipped_artifacts
from rebody.tasks.task_file import Switch, TaskSpec

HIDDEN_GOALS = np.linspace(2.0, 12.0, 5)
SPEEDS, SLOWEST = 5, 1.0
"""Speeds either way, from the slowest that the module learned on [m/s] to the fastest that the tracker did."""
SHOWN_S, CHANGE_S = 16.0, 5.0
"""Length of the filmed episode [s], and when its task changes: early enough that every robot can come back."""


@dataclass(frozen=True)
class Demo:
    """Transfer to every robot that has a tracker, zero-shot: tables, figures and videos on the shipped artifacts."""

    out: Path = Path("demo")
    """Folder for figures, videos and JSON."""

    def run(self) -> None:
        """Evaluate three agents on each robot, print, draw, film."""
        console = Console()
        console.print(
            "A module that learned on a point mass what a reward tells about a hidden task (go there, or run so fast)\n"
            "now drives robots that it has never seen. Nobody tells it the task.\n",
            highlight=False,
        )
        for path in (path for robot in robots_with_tracker() for path in self._files(robot)):
            check_output(path, "--out")
        for robot in robots_with_tracker():
            self._show(TrialOptions(robot=robot).load(), console)

    def _files(self, robot: str) -> list[Path]:
        return [self.out / f"{robot}{ending}" for ending in (".json", ".png", ".mp4", "-episode.png")]

    def _show(self, trial: Trial, console: Console) -> None:
        specs = hidden_tasks(trial)
        with console.status(f"{3 * len(specs)} episodes of 20 s on the {trial.robot_name}"):
            yardsticks = take_yardsticks(trial, specs, 1)
            reuse, oracle, idle = (
                evaluate(replace(trial, agent=agent), specs, 1, yardsticks) for agent in ("reuse", "oracle", "idle")
            )
        console.print(_table(reuse, oracle, idle))
        console.print(summary_table([reuse, oracle, idle]))
        json, picture, video, figure = self._files(trial.robot_name)
        save_results(reuse, json)
        plot_transfer(reuse, oracle, idle, picture)
        written = [json, picture, figure]
        shown, spec = replace(trial, seconds=SHOWN_S), shown_task(trial)
        try:
            episode = shoot(shown, spec, video)
            written.append(video)
        except RebodyError as error:
            console.print(f"no video: {error}", markup=False)
            episode = evaluate(shown, [spec], 1).episodes[0]
        plot_episode(episode, figure)
        console.print(f"\nfilmed: {describe(episode)}", highlight=False)
        console.print("written: " + ", ".join(map(str, written)) + "\n", highlight=False)


def robots_with_tracker() -> list[str]:
    """Robots of the line whose tracker ships."""
    trackers = {name for name, kind in shipped_artifacts() if kind == "tracker"}
    return [robot for robot in shipped_robots() if f"tracker-{robot}" in trackers]


def hidden_tasks(trial: Trial) -> list[TaskSpec]:
    """Goals and speeds, front and back, that the robot can reach in 20 s."""
    assert trial.robot is not None
    speeds = dict(trial.robot.reach)["velocity"]
    (slowest,), (fastest,) = speeds.low, speeds.high
    goals = [round(float(sign * goal), 2) for sign in (-1, 1) for goal in HIDDEN_GOALS]
    both_ways = np.concatenate([np.linspace(-SLOWEST, slowest, SPEEDS), np.linspace(SLOWEST, fastest, SPEEDS)])
    tasks = [TaskSpec("goal", (goal,)) for goal in goals]
    return tasks + [TaskSpec("velocity", (round(float(speed), 2),)) for speed in both_ways]


def shown_task(trial: Trial) -> TaskSpec:
    """Run forward, then go back to where it began."""
    assert trial.robot is not None
    speed = round(0.6 * dict(trial.robot.reach)["velocity"].high[0], 2)
    return TaskSpec("velocity", (speed,), Switch(at_s=CHANGE_S, family="goal", target=(2.0,)))


def _table(reuse: Results, oracle: Results, idle: Results) -> Table:
    """Each hidden task with three final errors."""
    table = Table(title=f"final error on the {reuse.robot}, 20 s", caption="idle: what a robot without inference gets")
    for column in ("hidden task", "read from the belief", "reuse", "oracle", "idle"):
        table.add_column(column, justify="right")
    for found, told, still in zip(reuse.episodes, oracle.episodes, idle.episodes, strict=True):
        table.add_row(
            f"{found.family} {vector(found.target, '+.2f')}",
            f"{found.inferred_family[-1]} {vector(found.inferred_target[-1], '+.2f')}",
            *(_error(episode) for episode in (found, told, still)),
        )
    return table


def _error(episode: EpisodeResult) -> str:
    return f"{episode.final_error:.3f}" + (" (fell)" if episode.fell else "")
