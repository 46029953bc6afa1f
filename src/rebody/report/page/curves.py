"""Learning curves: which columns of a training log are drawn together, and in which unit."""

from dataclasses import dataclass
from functools import partial
from itertools import cycle

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.report.page.drawing import CURVES, panel
from rebody.report.page.log import LARGEST, Log
from rebody.report.style import as_text
from rebody.tasks import FAMILIES

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
    limits: tuple[float | None, float | None] = (None, None)


def _policies(column: str) -> dict[str, str]:
    return {column: "policy", f"told/{column}": "policy that is told the task"}


_R2 = {f"evaluation/{family.name} R2": family.name for family in FAMILIES}

PANELS = (
    *(
        Panel(
            f"final error: {family.name}",
            f"error [{family.unit}]",
            {f"evaluation/{family.name} median": "median", f"evaluation/{family.name} p95": "95th percentile"},
            "log",
        )
        for family in FAMILIES
    ),
    Panel(
        "final error",
        "error [unit of the family]",
        {"evaluation/median error": "median", "evaluation/p95 error": "95th percentile"},
        "log",
    ),
    Panel("told to stand still", "speed [m/s]", {"evaluation/zero speed": "mean speed"}, "log"),
    Panel(
        "return",
        "return of an episode",
        {
            "return": "while it learns",
            "evaluation/return": "held-out tasks",
            "evaluation/oracle return": "held-out tasks, told",
        },
    ),
    Panel(
        "reward",
        "mean reward",
        {"reward": "while it learns", "task_reward": "of the task, while it learns", "evaluation/reward": "held out"},
    ),
    Panel(
        "shares of episodes",
        "share",
        {
            "evaluation/base task": "base task right",
            "evaluation/base task later": "base task right, later",
            "evaluation/fell": "fell",
        },
        limits=(0.0, 1.03),
    ),
    Panel(
        "falls",
        "falls per minute",
        {"falls_per_minute": "while it learns", "evaluation/falls per minute": "held out"},
    ),
    Panel("falls under a subgoal", "share of subgoals", {"falls": "while it learns"}),
    Panel(
        "targets read from the latent by a linear probe",
        "R²",
        {"evaluation/target R2": "target", **_R2},
        limits=(0.0, 1.03),
    ),
    Panel("reward that the decoder predicts", "error [unit of the reward]", {"reward_error": "error"}, "log"),
    Panel("state that the decoder predicts", "error [normalised]", {"state_error": "error"}, "log"),
    Panel("belief against prior", "KL divergence [nats]", {"kl": "KL divergence"}, "log"),
    Panel(
        "clusters",
        "number",
        {
            "mixture/components": "components",
            "mixture/births": "births",
            "mixture/merges": "merges",
            "mixture/deletes": "deletes",
        },
    ),
    Panel(
        "clusters against base tasks",
        "agreement",
        {"mixture/purity": "purity", "mixture/ari": "ARI", "mixture/nmi": "NMI"},
        limits=(0.0, 1.03),
    ),
    Panel("the mixture's bound", "ELBO of a belief [nats]", {"mixture/elbo": "ELBO"}),
    Panel("classifier", "cross-entropy [nats]", {"cross_entropy": "cross-entropy"}, "log"),
    Panel(
        "how long a subgoal is held",
        "control steps",
        {
            "steps": "while it learns",
            **{f"evaluation/control steps, {family.name}": f"held out, {family.name}" for family in FAMILIES},
        },
    ),
    Panel("subgoals reached", "error / subgoal", {"evaluation/relative error": "held out"}),
    Panel("value", "discounted return", _policies("value")),
    Panel("critics", "loss", _policies("critic_loss"), "log"),
    Panel("entropy of actions", "entropy [nats]", _policies("entropy")),
    Panel("temperature", "temperature", _policies("temperature"), "log"),
)
LEFT_OUT = ("iteration", "actor_loss", "told/actor_loss")
"""The axis, and what tells nothing beside entropy and value."""
_KNOWN = {*LEFT_OUT, *(column for each in PANELS for column in each.columns)}


def learning_curves(log: Log) -> dict[str, Markup]:
    """A figure per panel of which the log has a column, by title; columns that no panel knows get one each."""
    of_name = {f"column {name}": _plain(name) for name in log if name not in _KNOWN}
    panels = {each.title: each for each in PANELS} | of_name
    return {
        title: panel(partial(_draw, each, log))
        for title, each in panels.items()
        if any(_measured(log, column, each.scale) for column in each.columns)
    }


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
