"""Learning curves: which columns of a training log are drawn together, and in which unit."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import cycle
from typing import Any

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.report.page.drawing import CURVES, panel
from rebody.report.page.log import LARGEST, Log
from rebody.report.style import as_text
from rebody.tasks import SHIPPED

Limits = tuple[float | None, float | None]
SPARSE = 0.25
"""What is measured in a smaller share of iterations is drawn with dots."""


@dataclass(frozen=True)
class Panel:
    """One figure."""

    title: str
    axis: str
    """What the vertical axis shows, unit included."""
    columns: dict[str, str]
    """Of the log: what the legend calls each."""
    scale: str = "linear"
    limits: Limits = (None, None)


def _policies(title: str, axis: str, column: str, scale: str = "linear") -> Panel:
    return Panel(title, axis, {column: "policy", f"told/{column}": "policy that is told the task"}, scale)


def _errors(title: str, unit: str | None, median: str, p95: str) -> Panel:
    columns = {f"evaluation/{median}": "median", f"evaluation/{p95}": "95th percentile"}
    return Panel(title, f"error [{unit}]" if unit else "error", columns, "log")


def _mixture(title: str, axis: str, *columns: str, limits: Limits = (None, None)) -> Panel:
    return Panel(title, axis, {f"mixture/{column.lower()}": column for column in columns}, limits=limits)


LEARNING, HELD_OUT, SHARE = "while it learns", "held out", (0.0, 1.03)
OF_FAMILY = re.compile(r"evaluation/(?:control steps, (\w+)|(?!target )(\w+) (?:median|p95|R2))")
"""What is measured of each family, whatever its name."""
PANELS = (
    _errors("final error", "unit of the family", "median error", "p95 error"),
    Panel("told to stand still", "speed [m/s]", {"evaluation/zero speed": "mean speed"}, "log"),
    Panel(
        "return",
        "return of an episode",
        {
            "return": LEARNING,
            "evaluation/return": "held-out tasks",
            "evaluation/oracle return": "held-out tasks, told",
        },
    ),
    Panel(
        "reward",
        "mean reward",
        {"reward": LEARNING, "task_reward": f"of the task, {LEARNING}", "evaluation/reward": HELD_OUT},
    ),
    Panel(
        "shares of episodes",
        "share",
        {
            "evaluation/base task": "base task right",
            "evaluation/base task later": "base task right, later",
            "evaluation/fell": "fell",
        },
        limits=SHARE,
    ),
    Panel("falls", "falls per minute", {"falls_per_minute": LEARNING, "evaluation/falls per minute": HELD_OUT}),
    Panel("falls under a subgoal", "share of subgoals", {"falls": LEARNING}),
    Panel("reward that the decoder predicts", "error [unit of the reward]", {"reward_error": "error"}, "log"),
    Panel("state that the decoder predicts", "error [normalised]", {"state_error": "error"}, "log"),
    Panel("belief against prior", "KL divergence [nats]", {"kl": "KL divergence"}, "log"),
    _mixture("clusters", "number", "components", "births", "merges", "deletes"),
    _mixture("clusters against base tasks", "agreement", "purity", "ARI", "NMI", limits=SHARE),
    _mixture("the mixture's bound", "ELBO of a belief [nats]", "ELBO"),
    Panel("classifier", "cross-entropy [nats]", {"cross_entropy": "cross-entropy"}, "log"),
    Panel("short courses on the toy", "return", {"told/return": "policy that is told the task"}),
    Panel("courses of the navigator", "left of what was asked", {"left": LEARNING}, "log"),
    Panel("subgoals reached", "error / subgoal", {"evaluation/relative error": HELD_OUT}),
    _policies("value", "discounted return", "value"),
    _policies("critics", "loss", "critic_loss", "log"),
    _policies("entropy of actions", "entropy [nats]", "entropy"),
    _policies("temperature", "temperature", "temperature", "log"),
)
LEFT_OUT = ("iteration", "actor_loss", "told/actor_loss")
"""The axis, and what tells nothing beside entropy and value."""


def learning_curves(log: Log, settings: Any = None) -> dict[str, Markup]:
    """A figure per panel of which the log has a column, by title; columns that no panel knows get one each.

    Units of families are those that a run's settings tell, else of those that ship.
    """
    known = panels_of(log, {family.name: family.unit for family in SHIPPED} | dict(_units(settings)))
    drawn = {*LEFT_OUT, *(column for each in known for column in each.columns)}
    of_name = {f"column {name}": _plain(name) for name in log if name not in drawn}
    panels = {each.title: each for each in known} | of_name
    return {
        title: panel(partial(_draw, each, log))
        for title, each in panels.items()
        if any(_measured(log, column, each.scale) for column in each.columns)
    }


def panels_of(columns: Iterable[str], units: dict[str, str]) -> list[Panel]:
    """Those of every log, after and before those of the families that columns are about."""
    found = (OF_FAMILY.fullmatch(column) for column in columns)
    families = dict.fromkeys(match[1] or match[2] for match in found if match)
    r2 = {"evaluation/target R2": "target", **{f"evaluation/{name} R2": name for name in families}}
    held = {"steps": LEARNING, **{f"evaluation/control steps, {name}": f"{HELD_OUT}, {name}" for name in families}}
    return [
        *(_errors(f"final error: {f}", units.get(f), f"{f} median", f"{f} p95") for f in families),
        *PANELS,
        Panel("targets read from the latent by a linear probe", "R²", r2, limits=SHARE),
        Panel("how long a subgoal is held", "control steps", held),
    ]


def _units(settings: Any) -> Iterator[tuple[str, str]]:
    """Of families, wherever they are in a run's settings."""
    if isinstance(settings, dict):
        match settings:
            case {"name": str(name), "quantity": {"unit": str(unit)}}:
                yield name, as_text(unit)
        settings = list(settings.values())
    for each in settings if isinstance(settings, list) else ():
        yield from _units(each)


def _plain(name: str) -> Panel:
    return Panel(as_text(f"column {name}"), as_text(name), {name: as_text(name)})


def _draw(each: Panel, log: Log, axes: Axes) -> None:
    colours, iteration = cycle(CURVES), log["iteration"]
    for column, label in each.columns.items():
        there = _there(log, column, each.scale)
        if there.any():
            style = "o-" if there.mean() < SPARSE or there.sum() == 1 else "-"
            points = iteration[there], log[column][there]
            said = None if label == each.axis else label
            axes.plot(*points, style, ms=3.5, lw=1.3, color=next(colours), label=said)
    begin = min(0.0, iteration[0])
    axes.set(title=each.title, xlabel="iteration")
    axes.set(xlim=(begin, begin + 1.02 * (iteration[-1] - begin or 1.0)))
    axes.set(ylabel=each.axis, yscale=each.scale, ylim=each.limits)


def _there(log: Log, column: str, scale: str) -> np.ndarray:
    """Which rows of a column can be drawn on that scale."""
    if column not in log:
        return np.zeros(1, bool)
    return np.isfinite(log[column]) if scale == "linear" else log[column] > 1 / LARGEST


def _measured(log: Log, column: str, scale: str) -> bool:
    return bool(_there(log, column, scale).any())
