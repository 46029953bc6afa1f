"""`rebody figure`."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from rebody.cli.output import check_output
from rebody.report.thesis import find_figures, make_figure


@dataclass(frozen=True)
class Figures:
    """Draw figures of the thesis' chapter 6 by number."""

    numbers: tyro.conf.Positional[tuple[str, ...]]
    """Such as 6.3 6.9, or all; `rebody list` has them."""
    out: Path = Path("figures")
    """Folder for the PNGs."""
    rerun: bool = False
    """Make their logs anew instead of taking those that ship: episodes take minutes, training runs longer."""

    def run(self) -> None:
        """Draw each, say where."""
        console = Console(soft_wrap=True)
        figures = find_figures(self.numbers)
        for figure in figures:
            check_output(self.out / f"{figure.number}.png", "--out")
        for figure in figures:
            with console.status(f"{figure.number}: {figure.title}"):
                path = make_figure(figure, self.out, rerun=self.rerun)
            console.print(f"{path}: {figure.title}", markup=False, highlight=False)
