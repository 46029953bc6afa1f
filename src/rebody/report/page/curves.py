"""Learning curves: which columns of a training log are drawn together, and in which unit."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from itertools import cycle

import numpy as np
from jaxtyping import Float
from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.report.page.drawing import CURVES, panel
from rebody.tasks import FAMILIES

Log = Mapping[str, Float[np.ndarray, " iteration"]]

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
    unknown = (Panel(name, name, {name: name}) for name in log if name not in _KNOWN)
    drawn = [each for each in (*PANELS, *unknown) if any(_measured(log, column) for column in each.columns)]
    return {each.title: panel(partial(_draw, each, log)) for each in drawn}


def _draw(each: Panel, log: Log, axes: Axes) -> None:
    colours = cycle(CURVES)
    for column, label in each.columns.items():
        if _measured(log, column):
            there = np.isfinite(log[column])
            style = "o-" if there.mean() < SPARSE else "-"
            points = log["iteration"][there], log[column][there]
            axes.plot(*points, style, ms=3.5, lw=1.3, color=next(colours), label=label)
    axes.set(title=each.title, xlabel="iteration", xlim=(0, 1.02 * log["iteration"][-1]))
    axes.set(ylabel=each.axis, yscale=each.scale, ylim=each.limits)
    axes.legend(frameon=False, fontsize=8)


def _measured(log: Log, column: str) -> bool:
    return column in log and bool(np.isfinite(log[column]).any())
