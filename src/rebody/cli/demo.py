"""`rebody demo`: the main job on the shipped artifacts."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from rebody.cli.run import describe, shoot
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import Results, evaluate, save_results, summary_table
from rebody.report import plot_episode, plot_transfer
from rebody.tasks.task_file import TaskSpec

HIDDEN_GOALS = np.linspace(-9.5, 9.5, 20)
SHOWN = TaskSpec("goal", 7.0)


@dataclass(frozen=True)
class Demo:
    """Transfer to the cheetah, zero-shot: table, figures and a video on the shipped artifacts."""

    out: Path = Path("demo")
    """Folder for figures, video and JSON."""

    def run(self) -> None:
        """Evaluate three agents, print, draw, film."""
        console = Console()
        console.print(
            "A module that learned on a point mass what a reward tells about a hidden goal\n"
            "now drives a robot that it has never seen. Nobody tells it the goal.\n",
            highlight=False,
        )
        trial = TrialOptions(robot="cheetah", inference="position").load()
        specs = [TaskSpec("goal", round(float(goal), 2)) for goal in HIDDEN_GOALS]
        with console.status("60 episodes of 20 s on the cheetah"):
            reuse, oracle, idle = (
                evaluate(replace(trial, agent=agent), specs, 1) for agent in ("reuse", "oracle", "idle")
            )
        console.print(_table(reuse, oracle, idle))
        console.print(summary_table([reuse, oracle, idle]))
        save_results(reuse, self.out / "reuse.json")
        plot_transfer(reuse, oracle, idle, self.out / "transfer.png")
        written = ["reuse.json", "transfer.png", "episode.png"]
        shorter = replace(trial, seconds=10.0)
        try:
            episode = shoot(shorter, SHOWN, self.out / "cheetah.mp4")
            written.append("cheetah.mp4")
        except RebodyError as error:
            console.print(f"no video: {error}", markup=False)
            episode = evaluate(shorter, [SHOWN], 1).episodes[0]
        plot_episode(episode, self.out / "episode.png")
        console.print(f"\nfilmed: {describe(episode)}", highlight=False)
        console.print("written: " + ", ".join(str(self.out / name) for name in written), highlight=False)


def _table(reuse: Results, oracle: Results, idle: Results) -> Table:
    """Each hidden goal with three final errors."""
    table = Table(title="final error [m] on the cheetah, 20 s", caption="idle: what a robot without inference gets")
    for column in ("hidden goal", "read from the belief", "reuse", "oracle", "idle"):
        table.add_column(column, justify="right")
    for found, told, still in zip(reuse.episodes, oracle.episodes, idle.episodes, strict=True):
        table.add_row(
            f"{found.target:+.1f} m",
            f"{found.inferred_target[-1]:+.2f} m",
            *(f"{episode.final_error:.3f}" for episode in (found, told, still)),
        )
    return table
