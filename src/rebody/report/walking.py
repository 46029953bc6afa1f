"""What a walking policy makes of commands, drawn: commanded against reached, a panel for each way."""

from pathlib import Path

import numpy as np

from rebody.bodies.walking.joystick import UNITS
from rebody.bodies.walking.measure import WalkingMeasured
from rebody.report.style import BELIEF, MOTION, as_text, figure


def plot_walking(measured: WalkingMeasured, robot: str, path: Path) -> None:
    """Write a PNG."""
    with figure(path, 1, len(measured.ways), size=(11.0, 3.6)) as (drawing, panels):
        drawing.suptitle(f"{as_text(robot)}: commanded and reached")
        for panel, way, unit, dead in zip(panels, measured.ways, UNITS, measured.dead, strict=True):
            ends = np.array([way.commanded.min(initial=-0.1), way.commanded.max(initial=0.1)])
            panel.plot(ends, ends, color="0.7", linewidth=1, label="as commanded")
            panel.plot(way.commanded, way.reached, marker="o", markersize=3, color=MOTION, label="reached")
            if way.fell.any():
                panel.plot(way.commanded[way.fell], way.reached[way.fell], "x", color=BELIEF, label="fell")
            if 0 < dead < np.inf:
                panel.axvspan(-dead, dead, color="0.92", zorder=0, label="dead band")
            panel.set(xlabel=f"{way.way}, commanded [{unit}]", ylabel=f"reached [{unit}]")
