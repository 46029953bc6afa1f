"""`rebody infer`."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro
from rich.console import Console
from rich.markup import escape

from rebody.agents.parts import load_inference
from rebody.cli.output import check_output
from rebody.evaluation.logs import (
    BeliefOverTime,
    Delimiter,
    Format,
    Log,
    TimeUnit,
    begun_at_zero,
    believe,
    doubts,
    proposals,
    read_log,
    resample,
    save_beliefs,
)
from rebody.report import plot_beliefs
from rebody.tasks.family_file import read_families
from rebody.types import GLOBAL_FIELDS

TABLE, PICTURE = "belief.csv", "belief.png"


@dataclass(frozen=True)
class Infer:
    """What a frozen module believes over a logged run: the first test for a robot of one's own."""

    log: Annotated[Path, tyro.conf.Positional]
    """CSV with the columns time_s, reward, and those that the module sees: position_m, velocity_m_s, pitch_rad."""
    inference: str = "goal-velocity"
    """Inference artifact: a shipped name or a folder."""
    families: Path | None = None
    """File of your own families, where the module knows any with a reward law of your own."""
    out: Path | None = None
    """Folder for belief.csv and belief.png."""
    sharpen: bool = False
    """Sharpen beliefs, where the module has experts for it: for rewards of the very states beside them. A module that
    hears any law always does."""
    skip_bad_rows: bool = False
    """Leave out rows with NaN, unreadable or too large numbers, missing cells, or time stamps that do not ascend, hear
    nothing in gaps of more than 0.3 s, and say how many there were."""
    delimiter: Delimiter = "comma"
    """What stands between two cells."""
    decimal_comma: bool = False
    """Read 0,5 as 0.5."""
    time_unit: TimeUnit = "s"
    """Unit of the column time_s."""

    def run(self) -> None:
        """Read, listen, write, say what is believed at the end."""
        for name in (TABLE, PICTURE):
            check_output(self.out and self.out / name, "--out", inputs=(self.log,))
        read_families(self.families)  # artifacts may name its laws
        inference, console = load_inference(self.inference), Console(soft_wrap=True)
        contract = inference.contract
        form = Format(self.delimiter, self.decimal_comma, self.time_unit)
        also = GLOBAL_FIELDS if contract.any_law else ()  # by which rewards may be explained that no known task pays
        log = begun_at_zero(read_log(self.log, contract.fields, form, self.skip_bad_rows, also), contract)
        decisions = resample(log, contract.fields)
        with console.status(f"{len(decisions.reward)} decisions"):
            run = believe(inference, decisions, self.sharpen or contract.any_law)
        for note in (*log.notes, *run.notes):
            console.print(f"note: {note}", markup=False, highlight=False)
        if log.ignored:
            console.print(f"not looked at: {', '.join(log.ignored)}", markup=False, highlight=False)
        for doubt in (*doubts(log, decisions, contract), *run.doubts):
            console.print(f"[bold yellow]doubtful:[/] {escape(doubt)}", highlight=False)
        if self.out is not None:
            save_beliefs(run, self.out / TABLE)
            plot_beliefs(run, self.out / PICTURE)
        console.print(f"{inference.name} {run.conclusion()}", highlight=False)
        for line in _explained(run, log):
            console.print(line, markup=False, highlight=False)


def _explained(run: BeliefOverTime, log: Log) -> Iterator[str]:
    """How much of the rewards that explains, and what else would explain more; nothing for modules of own laws."""
    share = run.readings[-1].explained
    if share is None or not run.believed:
        return
    yield f"that explains {100 * share:.1f} % of the rewards' variance"
    if run.unexplained:
        found = proposals(log, run.unexplained)
        yield "what would explain them:" if found else "nor does any quantity that the log has a column for"
        yield from (f"  {proposal}" for proposal in found)
