"""`rebody list`."""

from dataclasses import dataclass

from rich.console import Console
from rich.table import Table

from rebody import names

WHOLE_LINES = 1000
"""Columns of what is no terminal: no line is longer."""


@dataclass(frozen=True)
class List:
    """Bodies, task families, agents, presets, shipped artifacts and figures."""

    def run(self) -> None:
        """Print them."""
        table = Table(show_header=False, box=None, padding=(0, 2))
        for _ in range(3):
            table.add_column(overflow="fold")  # a name that is cut is no name
        table.add_row("body", names.POINT_MASS, "the toy")
        for robot in names.shipped_robots():
            table.add_row("body", robot, "MuJoCo robot")
        tables = {
            "family": names.families(),
            "agent": names.AGENTS,
            "preset": names.presets(),
            "artifact": names.artifact_titles(),
            "figure": names.FIGURES,
        }
        for kind, lines in tables.items():
            for name, line in lines.items():
                table.add_row(kind, name, line)
        console = Console()
        if not console.is_terminal:
            console.width = WHOLE_LINES
        console.print(table)
