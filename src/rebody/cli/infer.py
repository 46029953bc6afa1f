"""`rebody infer`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console

from rebody.agents.parts import load_inference
from rebody.cli.output import check_output
from rebody.errors import RebodyError
from rebody.evaluation.logs import believe, doubts, read_log, resample, save_beliefs
from rebody.report import plot_beliefs

TABLE, PICTURE = "belief.csv", "belief.png"


@dataclass(frozen=True)
class Infer:
    """What a frozen module believes over a logged run: the first test for a robot of one's own."""

    log: Annotated[Path, tyro.conf.Positional]
    """CSV with the columns time_s, reward, and those that the module sees: position_m, velocity_m_s, pitch_rad."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    out: Path | None = None
    """Folder for belief.csv and belief.png."""

    def run(self) -> None:
        """Read, listen, write, say what is believed at the end."""
        if self.out is not None:
            check_output(self.out / TABLE, "--out")
            if (self.out / TABLE).resolve() == self.log.resolve():
                raise RebodyError(f"--out {self.out} would write over the log. Choose another folder.")
        inference, console = load_inference(self.inference), Console(soft_wrap=True)
        fields = inference.contract.fields
        log = read_log(self.log, fields)
        decisions = resample(log, fields)
        if log.ignored:
            console.print(f"not looked at: {', '.join(log.ignored)}", markup=False, highlight=False)
        for doubt in doubts(log, decisions, inference.contract):
            console.print(f"[bold yellow]doubtful:[/] {doubt}", highlight=False)
        with console.status(f"{len(decisions.reward)} decisions"):
            run = believe(inference, decisions)
        if self.out is not None:
            save_beliefs(run, self.out / TABLE)
            plot_beliefs(run, self.out / PICTURE)
        console.print(f"{inference.name} {run.conclusion()}", highlight=False)
