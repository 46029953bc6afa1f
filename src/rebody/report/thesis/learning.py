"""Figures of training curves."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TRUTH
from rebody.report.thesis.data import Data, split
from rebody.report.thesis.panels import Panel

TOY_STEPS = "toy steps [million]"
FLAT_ROWS, TRACKER_ROWS = 25, 30
"""Iterations whose mean is drawn: two episodes of the flat policy's training, whose robots begin all at once."""
HIGH_LEVELS = {
    "high-level-goal-velocity-cheetah": MOTION,
    "high-level-goal-velocity-noise-0-cheetah": BELIEF,
    "high-level-goal-velocity-walker": TRUTH,
    "high-level-goal-velocity-hopper": IDLE,
    "high-level-goal-velocity-stand-cheetah": ORACLE,
}
"""High-level policies that were learned on robots, and their colours."""


@dataclass(frozen=True)
class Curve:
    """A column of a training log."""

    column: str
    label: str
    colour: str = MOTION
    part: str | None = None
    """Which log of several."""
    rows: int = 1
    """Iterations whose mean is drawn."""


def curves(ylabel: str, *drawn: Curve, levels: Mapping[str, float] | None = None, **settings: Any) -> Panel:
    """Training curves over steps, and levels to compare them with; what is measured now and then has dots."""

    def panel(axes: Axes, data: Data) -> None:
        for curve in drawn:
            log = smoothed(split(data, curve.part) if curve.part else data, curve.column, curve.rows)
            measured = np.isfinite(log[curve.column])
            points = log["steps"][measured] / 1e6, log[curve.column][measured]
            style = "o-" if curve.column.startswith("evaluation/") else "-"
            axes.plot(*points, style, color=curve.colour, ms=3.5, lw=1.3, label=curve.label)
        for label, value in (levels or {}).items():
            axes.axhline(value, color=ORACLE, ls="--", lw=1.1, label=label)
        axes.set(**{"xlabel": "control steps [million]", "ylabel": ylabel} | settings)

    return panel


def smoothed(log: Data, name: str, rows: int) -> Data:
    """A training log with a column's mean over so many rows in its place."""
    rows = min(rows, len(log[name]))
    mean = np.convolve(log[name], np.full(rows, 1 / rows), mode="valid")
    return log | {name: mean, "steps": log["steps"][rows - 1 :]}


def title_of(high_level: str) -> str:
    """Robot and module of a high-level policy."""
    module, _, robot = high_level.removeprefix("high-level-").rpartition("-")
    return f"{robot}, {module}"


def _returns(held_out: str, **settings: Any) -> Panel:
    return curves(
        "return over 20 s",
        Curve("return", "training episodes", "#9dbbd3"),
        Curve("evaluation/return", held_out),
        Curve("evaluation/oracle return", f"{held_out}, told", ORACLE),
        xlabel=TOY_STEPS,
        **settings,
    )


def _errors(slot: str, unit: str, levels: Mapping[str, float] | None = None) -> Panel:
    median, p95 = f"evaluation/{slot} median", f"evaluation/{slot} p95"
    drawn = Curve(median, "median"), Curve(p95, "95th percentile", BELIEF)
    return curves(f"{slot}: final error [{unit}]", *drawn, levels=levels, yscale="log")


def _trackers(column: str, label: str, scale: str) -> Panel:
    colours = {"tracker-hopper": MOTION, "tracker-walker": BELIEF}
    drawn = (Curve(column, name, colour, name, TRACKER_ROWS) for name, colour in colours.items())
    return curves(label, *drawn, yscale=scale)


TOY = ((_returns("held-out goals"),),)
FLAT = (
    (
        curves(
            "reward per decision [m]",
            Curve("task_reward", "while exploring", rows=FLAT_ROWS),
            levels={"standing still": -5.0},
        ),
        _errors("goal", "m", {"standing still: median": 5.0}),
    ),
)
TRACKER = ((_errors("goal", "m"), _errors("velocity", "m/s"), _errors("stand", "rad")),)
TRACKERS = (
    (
        _trackers("reward", "reward per control step", "linear"),
        _trackers("falls_per_minute", "falls per minute of a robot", "log"),
    ),
)
SEVERAL = (
    (
        _returns("held-out tasks", ylim=(-300, 0)),
        curves(
            "final error [m], [m/s]",
            Curve("evaluation/goal median", "goal, median"),
            Curve("evaluation/velocity median", "velocity, median", BELIEF),
            xlabel=TOY_STEPS,
            yscale="log",
        ),
    ),
    (
        curves(
            "clusters",
            Curve("mixture/components", "components", TRUTH),
            Curve("mixture/births", "births in the iteration"),
            Curve("mixture/merges", "merges in the iteration", BELIEF),
            xlabel=TOY_STEPS,
            ylim=(0, None),
        ),
        curves(
            "agreement with base tasks",
            Curve("mixture/purity", "purity"),
            Curve("mixture/ari", "adjusted Rand index", BELIEF),
            xlabel=TOY_STEPS,
            ylim=(0, 1.02),
        ),
    ),
)
RETRAINED = (
    (
        curves(
            "return over 20 s",
            *(Curve("evaluation/return", title_of(name), colour, name) for name, colour in HIGH_LEVELS.items()),
            xlabel="decisions on the robot [million]",
        ),
    ),
)
