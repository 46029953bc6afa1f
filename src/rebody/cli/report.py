"""`rebody report`."""

from dataclasses import dataclass
from pathlib import Path

import tyro
from rich.console import Console

from rebody.cli.output import check_output
from rebody.errors import RebodyError
from rebody.report.page import EXPECTED, find, write_page
from rebody.tasks.family_file import read_families


@dataclass(frozen=True)
class Report:
    """One HTML page, which needs no network, of runs, artifacts, results, figures and videos."""

    runs: tyro.conf.Positional[tuple[str, ...]]
    """Folders of training runs or artifacts, names of shipped artifacts, JSONs of `rebody evaluate`, folders of JSONs,
    figures and videos (such as demo)."""
    out: Path = Path("report.html")
    """Where the page goes."""
    families: Path | None = None
    """File of your own families, where results are of any with a reward law of your own."""

    def run(self) -> None:
        """Read all, write the page, say where it is."""
        if not self.runs:
            raise RebodyError(f"there is nothing to report. {EXPECTED}")
        check_output(self.out, "--out", (".html",), inputs=self.runs)
        read_families(self.families)  # results may name its laws
        console = Console(soft_wrap=True)
        with console.status("reading"):
            found = [find(reference) for reference in self.runs]
        with console.status("drawing"):
            write_page(found, self.out)
        size = self.out.stat().st_size / 1e6
        console.print(f"written: {self.out} ({size:.1f} MB)", markup=False, highlight=False)
