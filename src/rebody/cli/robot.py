"""`rebody robot`."""

from dataclasses import dataclass
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rebody.bodies import load_robot
from rebody.bodies.check import check_robot
from rebody.errors import RebodyError


@dataclass(frozen=True)
class Robot:
    """Robots of one's own, a short TOML beside an MJCF: load one, run it, and say what is missing."""

    action: Annotated[Literal["check"], tyro.conf.Positional]
    """What to do with it."""
    robot: Annotated[str, tyro.conf.Positional]
    """Path of the robot's TOML file, or the name of a shipped one."""

    def run(self) -> None:
        """Print what was found; RebodyError where something is wrong."""
        spec = load_robot(self.robot)
        findings = check_robot(spec)
        table = Table(show_header=False, box=None, padding=(0, 2))
        for finding in findings:
            table.add_row("ok" if finding.is_right else "[bold red]wrong[/]", finding.subject, escape(finding.says))
        console = Console()
        console.print(table)
        wrong = [finding.subject for finding in findings if not finding.is_right]
        if wrong:
            raise RebodyError(f"robot '{spec.name}' is not ready: see {', '.join(wrong)}.")
        console.print(f"ready: rebody train tracker {self.robot} --out runs/tracker-{spec.name}", markup=False)
