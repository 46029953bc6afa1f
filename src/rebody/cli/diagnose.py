"""`rebody diagnose`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.cli.output import PICTURES, check_output
from rebody.cli.trial import TrialOptions
from rebody.errors import RebodyError
from rebody.evaluation import save_results
from rebody.evaluation.diagnosis import EXACT, LADDER, WALKING_LADDER, diagnose, diagnosis_tables
from rebody.ranges import Seeds
from rebody.report.diagnosis import plot_diagnosis
from rebody.tasks.task_file import read_tasks, task_entries


@dataclass(frozen=True)
class Diagnose:
    """Which part lost what: the same tasks by agents that differ by one part each, up to `reuse`."""

    tasks: Path
    """Task file: [{"family": "goal", "target": -9.0}, ...]."""
    seeds: Seeds = 1
    """Every task once per evaluation seed 0 to N-1."""
    figure: Path | None = None
    """Where a PNG goes."""
    out: Path | None = None
    """Folder for the JSON of each agent, which `rebody report` reads."""
    trial: Annotated[TrialOptions, tyro.conf.arg(name="")] = field(default_factory=TrialOptions)

    def run(self) -> None:
        """Evaluate all, print tables, draw."""
        if self.trial.agent != "reuse" or self.trial.thesis:
            raise RebodyError("a diagnosis is of `reuse` in its own time: leave --agent and --thesis out.")
        if self.trial.law is not None:
            raise RebodyError("a diagnosis needs `bayes`, which believes by the families' own laws: leave --law out.")
        check_output(self.figure, "--figure", PICTURES, inputs=(self.tasks,))
        if self.out is not None:
            for agent in LADDER:
                check_output(self.out / f"{agent}.json", "--out", inputs=(self.tasks,))
        task_entries(self.tasks)
        trial, console = self.trial.load(), Console()
        specs = read_tasks(self.tasks, trial.in_play)
        with console.status("") as status:
            diagnosis = diagnose(trial, specs, self.seeds, lambda agent: status.update(_doing(agent)))
        for table in diagnosis_tables(diagnosis):
            console.print(table)
        if self.out is not None:
            for agent in diagnosis.results.keys() - {EXACT}:  # its agent is an oracle, but on no robot
                save_results(diagnosis.results[agent], self.out / f"{agent}.json")
        if self.figure is not None:
            plot_diagnosis(diagnosis, self.figure)


def _doing(agent: str) -> str:
    return f"{list(WALKING_LADDER).index(agent) + 1} of {len(WALKING_LADDER)}: {agent}"
