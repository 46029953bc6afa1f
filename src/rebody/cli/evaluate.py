"""`rebody evaluate`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.cli.output import check_output
from rebody.cli.trial import TrialOptions
from rebody.evaluation import evaluate, save_results, summary_table
from rebody.ranges import Seeds
from rebody.tasks.task_file import read_tasks


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
        """Evaluate, save, print the table."""
        check_output(self.json, "--json", inputs=(self.tasks, self.trial.robot))
        specs = read_tasks(self.tasks)
        trial = self.trial.load()
        console = Console()
        with console.status(f"{len(specs) * self.seeds} episodes of {trial.seconds:g} s"):
            results = evaluate(trial, specs, self.seeds)
        if self.json is not None:
            save_results(results, self.json)
        console.print(summary_table([results]))
