"""What the figures are put together from."""

import textwrap

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rebody.report.style import MOTION, ORACLE, TASKS
from rebody.report.thesis.data import Data

LETTERS_PER_INCH = 15


def caption(drawing: Figure, text: str) -> None:
    """Put a caption below everything."""
    width = int(drawing.get_figwidth() * LETTERS_PER_INCH)
    lines = "\n".join(textwrap.fill(paragraph, width) for paragraph in text.split("\n"))
    drawing.supxlabel(lines, x=0.01, ha="left", fontsize=8.5, linespacing=1.4)


def draw_positions(axes: Axes, log: Data, against: str = "seconds") -> None:
    """x over time, each goal a dot of its colour at the end."""
    time = log["time_s"] / (log["decision_s"] if against == "decisions" else 1.0)
    for i, target in enumerate(log["target"]):
        axes.plot(time, log["position_m"][:, i], color=_colour(log, i), lw=1.1)
        axes.plot(time[-1], target, "o", color=_colour(log, i), ms=4, clip_on=False)
    axes.set(xlabel="time [s]" if against == "seconds" else "decisions", ylabel="x [m]", xlim=(0, time[-1]))


def draw_latents(axes: Axes, log: Data) -> None:
    """The latent's first number over time."""
    for i in range(len(log["target"])):
        axes.plot(log["time_s"], log["latent"][:, i, 0], color=_colour(log, i), lw=1.1)
    axes.set(xlabel="time [s]", ylabel="latent mean", xlim=(0, log["time_s"][-1]))


def draw_latents_over_targets(axes: Axes, log: Data) -> None:
    """All latents of the second half of each episode, above its target."""
    half = len(log["time_s"]) // 2
    latent = log["latent"][half:]
    for dimension in range(latent.shape[-1]):
        values = latent[..., dimension]
        name = "latent mean" if latent.shape[-1] == 1 else f"latent {dimension + 1}"
        axes.plot(np.broadcast_to(log["target"], values.shape).ravel(), values.ravel(), ".", ms=2.5, label=name)
    axes.set(xlabel="hidden goal [m]", ylabel="latent mean, second half")
    if latent.shape[-1] > 1:
        axes.legend(frameon=False, fontsize=8)


def draw_curve(axes: Axes, log: Data, name: str, label: str, *, colour: str = MOTION, dots: bool = False) -> None:
    """A training curve over steps, where it was measured."""
    measured = np.isfinite(log[name])
    style = "o-" if dots else "-"
    axes.plot(log["steps"][measured] / 1e6, log[name][measured], style, color=colour, ms=3.5, lw=1.3, label=label)


def smoothed(log: Data, name: str, rows: int) -> Data:
    """A training log with a column's mean over so many rows in its place."""
    rows = min(rows, len(log[name]))
    mean = np.convolve(log[name], np.full(rows, 1 / rows), mode="valid")
    return log | {name: mean, "steps": log["steps"][rows - 1 :]}


def draw_level(axes: Axes, value: float, label: str, colour: str = ORACLE) -> None:
    """A value to compare a curve with."""
    axes.axhline(value, color=colour, ls="--", lw=1.1, label=label)


def _colour(log: Data, episode: int):
    targets = log["target"]
    span = max(float(np.ptp(targets)), 1e-9)
    # the map's middle is too pale for a line
    share = (targets[episode] - targets.min()) / span
    return plt.get_cmap(TASKS)(0.42 * share if share < 0.5 else 1 - 0.42 * (1 - share))
