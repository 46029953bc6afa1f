"""`rebody demo`: the main job on the shipped artifacts."""

from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from rebody.bodies import load_robot, shipped_robots
from rebody.bodies.source import is_there
from rebody.cli.demo_tasks import hidden_tasks, shown_task
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

SHOWN_S = 16.0
"""Length of the filmed episode [s]."""
PLANE = "plane"
"""Module of the robots that walk by a policy which was learned here; the others have the default one."""


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
        trials = [TrialOptions(robot=robot) for robot in robots_of_the_line()]
        trials += [TrialOptions(robot=robot, inference=PLANE, seconds=30.0) for robot in walking_robots()]
        for path in (path for trial in trials for path in self._files(trial.robot)):
            check_output(path, "--out")
        for trial in trials:
            self._show(trial.load(), console)

    def _files(self, robot: str) -> list[Path]:
        return [self.out / f"{robot}{ending}" for ending in (".json", ".png", ".mp4", "-episode.png")]

    def _show(self, trial: Trial, console: Console) -> None:
        specs = hidden_tasks(trial)
        with console.status(f"{3 * len(specs)} episodes of {trial.seconds:g} s on the {trial.robot_name}"):
            yardsticks = take_yardsticks(trial, specs, 1)
            reuse, oracle, idle = (
                evaluate(replace(trial, agent=agent), specs, 1, yardsticks) for agent in ("reuse", "oracle", "idle")
            )
        console.print(_table(reuse, oracle, idle, trial.seconds))
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


def robots_of_the_line() -> list[str]:
    """Robots whose tracker ships and that walk by nothing else."""
    return [robot for robot in _with_tracker() if load_robot(robot).walking is None]


def walking_robots() -> list[str]:
    """Robots that walk by a policy which ships, and whose model is installed."""
    return [robot for robot in _with_tracker() if load_robot(robot).walking is not None]


def _with_tracker() -> list[str]:
    shipped = {name for name, _ in shipped_artifacts()}
    robots = [robot for robot in shipped_robots() if f"tracker-{robot}" in shipped]
    return [robot for robot in robots if is_there(load_robot(robot).mjcf)]


def _table(reuse: Results, oracle: Results, idle: Results, seconds: float) -> Table:
    """Each hidden task with three final errors."""
    table = Table(
        title=f"final error on the {reuse.robot}, {seconds:g} s",
        caption="idle: what a robot without inference gets",
    )
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
