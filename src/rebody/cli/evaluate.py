"""`rebody evaluate`."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.cli.output import check_output
from rebody.cli.trial import TrialOptions
from rebody.evaluation import evaluate, save_results, summary_table
from rebody.evaluation.evaluate import Yardsticks, take_yardsticks
from rebody.evaluation.trial import Trial
from rebody.ranges import Seeds
from rebody.tasks.task_file import read_tasks, task_entries


@dataclass(frozen=True)
class Evaluate:
    """Judge an agent on a file of hidden tasks: table, and JSON with every decision."""

    tasks: Path
    """Task file: [{"family": "goal", "target": -9.0}, ...]."""
    seeds: Seeds = 1
    """Every task once per evaluation seed 0 to N-1."""
    json: Path | None = None
    """Where the JSON goes."""
    trial: Annotated[TrialOptions, tyro.conf.arg(name="")] = field(default_factory=TrialOptions)

    def run(self) -> None:
        """Evaluate, print the table, save."""
        check_output(self.json, "--json", inputs=(self.tasks, self.trial.robot))
        task_entries(self.tasks)
        trial = self.trial.load()
        specs = read_tasks(self.tasks, trial.in_play)
        console = Console()
        with console.status(f"{len(specs) * self.seeds} episodes of {trial.seconds:g} s"):
            yardsticks = take_yardsticks(trial, specs, self.seeds)
            shown = [evaluate(each, specs, self.seeds, yardsticks) for each in beside_idle(trial, yardsticks)]
        console.print(summary_table(shown))  # first: it is there even if the disk is full by now
        if self.json is not None:
            save_results(shown[0], self.json)


def beside_idle(trial: Trial, yardsticks: Yardsticks) -> list[Trial]:
    """A trial, and what standing still gets in its place, where that is known."""
    if trial.agent == "idle" or yardsticks.idle is None:
        return [trial]
    return [trial, replace(trial, agent="idle", thesis=False)]
