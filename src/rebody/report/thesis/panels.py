"""What the figures are put together from: panels, functions of axes and a log."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from rebody.report.style import BELIEF, TASKS, TRUTH
from rebody.report.thesis.data import Data, split
from rebody.tasks import Family
from rebody.tasks.line import GOAL, JUMP, LINE, STAND, VELOCITY
from rebody.types import Task

Panel = Callable[[Axes, Data], Any]

LETTERS_PER_INCH = 15
BASE_TASKS = {
    (GOAL.name, "front"): ("goal in front", "#b5403c"),
    (GOAL.name, "back"): ("goal behind", "#2b6f9e"),
    (VELOCITY.name, "front"): ("run forward", "#e0a526"),
    (VELOCITY.name, "back"): ("run backward", "#4f9a6b"),
    (STAND.name, "front"): ("stand, pitch above 0", "#7d4e9e"),
    (STAND.name, "back"): ("stand, pitch below 0", "#5a5a5a"),
    (JUMP.name, "front"): ("jump", "#c2557f"),
}
"""Name and colour by family and direction."""
SERIES = {
    GOAL.name: ("position_m", "x [m]"),
    VELOCITY.name: ("velocity_m_s", "velocity [m/s]"),
    STAND.name: ("pitch_rad", "pitch [rad]"),
    JUMP.name: ("vz_max_m_s", "largest vertical speed of 1 s [m/s]"),
}
"""Of each family: what is to reach the target, and its label."""
EPISODES = 12
"""Of each base task in a picture of latents."""
SHOWN = 4
"""Of each base task in a picture of ways."""


def caption(drawing: Figure, text: str) -> None:
    """Put a caption below everything."""
    width = int(drawing.get_figwidth() * LETTERS_PER_INCH)
    lines = "\n".join(textwrap.fill(paragraph, width) for paragraph in text.split("\n"))
    drawing.supxlabel(lines, x=0.01, ha="left", fontsize=8.5, linespacing=1.4)


def titled(title: str, panels: Sequence[Panel]) -> tuple[Panel, ...]:
    """A row of panels with a title above the first."""

    def first(axes: Axes, log: Data) -> None:
        panels[0](axes, log)
        axes.set_title(title, fontsize=9, loc="left")

    return first, *panels[1:]


def of_part(part: str, panels: Sequence[Panel]) -> tuple[Panel, ...]:
    """Panels of one log of several."""
    return tuple(lambda axes, log, panel=panel: panel(axes, split(log, part)) for panel in panels)


def rows_of(titles: Mapping[str, str], panels: Sequence[Panel]) -> tuple[tuple[Panel, ...], ...]:
    """A row of the same panels for each of several logs, under its title."""
    return tuple(titled(title, of_part(part, panels)) for part, title in titles.items())


# episodes on goals


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
    latent = log["latent"][len(log["time_s"]) // 2 :]
    for dimension in range(latent.shape[-1]):
        values = latent[..., dimension]
        name = None if latent.shape[-1] == 1 else f"latent {dimension + 1}"
        axes.plot(np.broadcast_to(log["target"], values.shape).ravel(), values.ravel(), ".", ms=2.5, label=name)
    axes.set(xlabel="hidden goal [m]", ylabel="latent mean, second half")


def _colour(log: Data, episode: int):
    targets = log["target"]
    span = max(float(np.ptp(targets)), 1e-9)
    # the map's middle is too pale for a line
    share = (targets[episode] - targets.min()) / span
    return plt.get_cmap(TASKS)(0.42 * share if share < 0.5 else 1 - 0.42 * (1 - share))


# episodes on several families


def ways(family: Family) -> Panel:
    """A few episodes of each base task of a family, dotted what was hidden."""
    series, label = SERIES[family.name]

    def panel(axes: Axes, log: Data) -> None:
        for i in np.flatnonzero(log["family"] == LINE.index(family.name))[:: EPISODES // SHOWN]:
            _, colour = BASE_TASKS[labels(log)[i]]
            axes.plot(log["time_s"], log[series][:, i], color=colour, lw=1.2)
            axes.axhline(float(log["target"][i]), color=colour, lw=0.8, ls=":")
        axes.set(xlabel="time [s]", ylabel=label, xlim=(0, log["time_s"][-1]))

    return panel


def points(name: str, title: str = "", behind: str | None = None) -> Panel:
    """Points [time, episode, 2] in the colours of their base tasks, in front of the toy's in grey."""

    def panel(axes: Axes, log: Data) -> None:
        if behind is not None:
            axes.plot(*log[behind].reshape(-1, 2).T, ".", color="#d0d0d0", ms=7, label="on the toy")
        for base_task, (label, colour) in BASE_TASKS.items():
            is_of_task = [each == base_task for each in labels(log)]
            x, y = log[name][:, is_of_task].reshape(-1, 2).T
            if x.size:
                axes.plot(x, y, ".", color=colour, ms=3, label=label)
        axes.set(xticks=[], yticks=[], title=title)
        axes.legend(markerscale=2)

    return panel


def labels(log: Data) -> list[tuple[str, str]]:
    """Family and direction of each episode's task."""
    names = [(family.name, direction) for family in LINE for direction in family.direction_names]
    return [names[number] for number in LINE.base_task(Task(log["family"], log["target"][:, None]))]


# the toy


def draw_picture(axes: Axes, log: Data) -> None:
    """The toy as MuJoCo draws it."""
    axes.imshow(log["picture"])
    axes.axis("off")


def draw_forces(axes: Axes, _: Data) -> None:
    """The toy as an abstract model."""
    axes.add_patch(Circle((0, 0), 0.25, color="#2178b5"))
    axes.axhline(-0.25, color=TRUTH, lw=1)
    for tip, tail, label, place in (
        ((1.1, 0), (0.25, 0), r"$F = 7\,\mathrm{N} \cdot a$", (0.55, 0.08)),
        ((-0.9, 0), (-0.25, 0), r"$-c\,\dot x$", (-0.75, 0.08)),
        ((0, -0.8), (0, 0), r"$-m\,g$", (0.06, -0.75)),
        ((0, 0.6), (0, -0.25), r"$N$", (0.06, 0.5)),
    ):
        axes.annotate("", tip, tail, arrowprops={"arrowstyle": "-|>", "color": BELIEF, "lw": 1.8})
        axes.text(*place, label, fontsize=11)
    axes.annotate("", (-0.7, -0.55), (-1.2, -0.55), arrowprops={"arrowstyle": "->", "color": TRUTH})
    axes.text(-0.68, -0.59, "$x$", fontsize=11)
    axes.text(-1.25, 0.75, r"$m\,\ddot x = F - c\,\dot x$,  $m = 1$ kg, $c = 2$ N s/m", fontsize=11)
    axes.set(xlim=(-1.3, 1.3), ylim=(-0.95, 0.95), aspect="equal")
    axes.axis("off")
