"""The picture of a belief over a logged run."""

from itertools import cycle
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from rebody.evaluation.logs import COLUMNS, BeliefOverTime
from rebody.report.figures import components, set_plane
from rebody.report.plane import draw_ellipses, is_plane
from rebody.report.style import SHADES, TRUTH, as_text, figure
from rebody.tasks import Family
from rebody.tasks.figures import settled
from rebody.types import global_state

OUTLIERS = 5
"""Percentage of believed targets, at either end, that do not stretch an axis: first guesses may lie anywhere."""


def plot_beliefs(run: BeliefOverTime, path: Path) -> None:
    """Left, over time: the robot and the believed targets, the reward, how sure the module is of the family. Right:
    the latent's path, and the mixture's clusters where there are any.
    """
    rows = len(run.families) + 2
    with figure(path, rows, 2, size=(11.5, 1.9 * rows), width_ratios=(2.0, 1.0)) as (drawing, panels):
        over_time, right = panels[0::2], panels[1::2]
        for panel, family in zip(over_time, run.families, strict=False):
            _reached(panel, run, family)
        _reward(over_time[-2], run)
        _probabilities(over_time[-1], run)
        in_time = [panel for panel in over_time if panel.get_aspect() == "auto"]
        for panel in in_time:
            panel.set(xlim=(run.decisions.time_s[0], run.time_s[-1]))
        for panel in in_time[:-1]:
            panel.tick_params(labelbottom=False)
        grid = right[0].get_gridspec()
        for panel in right:
            panel.remove()
        split = rows if run.clusters.shape[1] == 0 else (rows + 1) // 2
        _latent(drawing.add_subplot(grid[:split, 1]), run)
        if split < rows:
            _clusters(drawing.add_subplot(grid[split:, 1]), run)
        drawing.suptitle(f"What '{as_text(run.inference)}' believes, from states and rewards alone")


def _reached(axes: Axes, run: BeliefOverTime, family: Family) -> None:
    fields, (first, *others) = run.decisions.fields, family.quantity.components
    reached = np.zeros((0, family.size))  # a module may hear of it by the reward alone
    if fields.keys() >= {first, *others}:
        reached = np.asarray(family.quantity.read(global_state(**fields)))
    is_believed = run.believes(family)
    believed, label = run.targets(family)[is_believed], f"believed {family.name}"
    if is_plane(family):
        reached = settled(family, reached)  # a gait would scribble all over
        axes.plot(*believed.T, ".", color=family.colour, label=label)
        draw_ellipses(axes, run.readings, np.flatnonzero(is_believed).tolist())
        axes.plot(*reached.T, color=TRUTH, lw=1.2, label="robot")
        set_plane(axes, family, *(_ends(family, reached[:, i], believed[:, i]) for i in (0, 1)))
    else:
        for i, name in enumerate(components(family)):
            shade = SHADES[i % len(SHADES)]
            belief = {"color": family.colour, "alpha": shade, "label": label + name}
            axes.plot(run.time_s[is_believed], believed[:, i], ".", **belief)
            if reached.size:
                axes.plot(run.decisions.time_s, reached[:, i], color=TRUTH, alpha=shade, lw=1.2, label=f"robot{name}")
        axes.set(ylabel=f"{family.name} [{family.unit}]" if others else COLUMNS.get(first, first))
        axes.set(ylim=_ends(family, reached, believed))
    axes.legend(loc="upper right")


def _ends(family: Family, reached: np.ndarray, believed: np.ndarray) -> tuple[float, float]:
    """Of an axis."""
    usual = np.percentile(believed, (OUTLIERS, 100 - OUTLIERS)) if believed.size else []
    shown = [*reached.ravel(), *usual, 0.0]
    margin = 0.1 * max(np.ptp(shown), family.tolerance)
    return min(shown) - margin, max(shown) + margin


def _reward(axes: Axes, run: BeliefOverTime) -> None:
    axes.plot(run.time_s, run.decisions.reward, color=TRUTH, lw=1.2)
    axes.set(ylabel="reward")


def _probabilities(axes: Axes, run: BeliefOverTime) -> None:
    for family in run.families:
        shares = [reading.probabilities[family.name] for reading in run.readings]
        axes.plot(run.time_s, shares, color=family.colour, label=family.name)
    axes.set(ylabel="probability", ylim=(-0.03, 1.03), xlabel="time [s]")
    axes.legend(loc="center right")


def _latent(axes: Axes, run: BeliefOverTime) -> None:
    """Its first two numbers; a latent of one number over time."""
    latent = run.latent
    is_plane = latent.shape[1] > 1
    across, up = (latent[:, 0], latent[:, 1]) if is_plane else (run.time_s, latent[:, 0])
    axes.plot(across, up, color=TRUTH, lw=0.5, alpha=0.4)
    for family in run.families:
        of = run.believes(family)
        axes.plot(across[of], up[of], ".", color=family.colour, label=f"believed: {family.name}")
    axes.plot(across[-1], up[-1], "o", color=TRUTH, mfc="none", ms=9, label="at the end")
    axes.set(
        xlabel="latent 1" if is_plane else "time [s]", ylabel="latent 2" if is_plane else "latent", title="the latent"
    )


def _clusters(axes: Axes, run: BeliefOverTime) -> None:
    lines = cycle(("-", "--", "-.", ":"))  # families have the colours, and nobody told the clusters of families
    for k, shares in zip(run.readings[-1].responsibilities, run.clusters.T, strict=True):
        if shares.max() > 0.5:  # of many, those that it ever belonged to
            axes.plot(run.time_s, shares, next(lines), color=TRUTH, label=f"cluster {k}")
    axes.set(xlabel="time [s]", ylabel="responsibility", ylim=(-0.03, 1.03), title="clusters found without labels")
    axes.legend(loc="center right")
