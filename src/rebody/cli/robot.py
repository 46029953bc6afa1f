"""`rebody robot`."""

from dataclasses import dataclass
from itertools import zip_longest
from math import inf
from pathlib import Path
from typing import Annotated, Literal

import tyro
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from rebody.bodies import load_robot
from rebody.bodies.check import check_robot
from rebody.bodies.walking.joystick import UNITS
from rebody.bodies.walking.measure import STANDS, WalkingMeasured, measure_walking
from rebody.bodies.walking.policy import has_policy
from rebody.cli.output import PICTURES, check_output
from rebody.errors import RebodyError
from rebody.report.walking import plot_walking


@dataclass(frozen=True)
class Robot:
    """Robots of one's own, a short TOML beside an MJCF: load one, run it, and say what is missing."""

    action: Annotated[Literal["check"], tyro.conf.Positional]
    """What to do with it."""
    robot: Annotated[str, tyro.conf.Positional]
    """Path of the robot's TOML file, or the name of a shipped one."""
    figure: Path | None = None
    """Where a PNG goes of what a robot that walks already makes of commands."""

    def run(self) -> None:
        """Print what was found; RebodyError where something is wrong."""
        check_output(self.figure, "--figure", PICTURES)
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
        if spec.walking is None or not has_policy(spec.walking):
            console.print(f"ready: rebody train tracker {self.robot} --out runs/tracker-{spec.name}", markup=False)
            return
        measured = measure_walking(spec)
        console.print(_walks(measured), highlight=False)
        if self.figure is not None:
            plot_walking(measured, spec.name, self.figure)
        console.print(_joystick(measured), markup=False, highlight=False)
        console.print(f"ready: rebody run --robot {self.robot} --inference plane --task place=3,2", markup=False)


def _walks(measured: WalkingMeasured) -> Table:
    """Commanded and reached, a row for every second command."""
    table = Table(title=f"commanded -> reached; {measured.falls} fell; lag {measured.lag_s:.2g} s")
    for way, unit in zip(measured.ways, UNITS, strict=True):
        table.add_column(escape(f"{way.way} [{unit}]"))
    rows = [
        [f"{a:+.2f} -> {b:+.2f}" for a, b in zip(way.commanded[::2], way.reached[::2], strict=True)]
        for way in measured.ways
    ]
    for row in zip_longest(*rows, fillvalue=""):
        table.add_row(*row)
    return table


def _joystick(measured: WalkingMeasured) -> str:
    """What the description's [policy.joystick] is to say: what hardly drifts stands still; a way that is never followed
    is closed.
    """
    dead = [0.0 if slowest == inf else slowest for slowest in measured.dead]
    closed = [way.way for way, slowest in zip(measured.ways, measured.dead, strict=True) if slowest == inf]
    drift = [float(each) if abs(each) >= STANDS else 0.0 for each in measured.drift]
    lines = [f"{name} = [{', '.join(f'{each:.2f}' for each in of)}]" for name, of in (("dead", dead), ("drift", drift))]
    lines += [f"at_once = {measured.at_once:.1f}", f"rate = {measured.rate:.1f}"]
    lines += [f"{way} = [0.0, 0.0]  # what it is told is hardly followed" for way in closed]
    return "for [policy.joystick] of its file:\n  " + "\n  ".join(lines)
