"""Figures of results and of what they tell together."""

from collections.abc import Iterable, Mapping
from functools import partial
from itertools import cycle, product
from typing import Any

from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.evaluation.results import Results
from rebody.report.figures import draw_beliefs, draw_errors, draw_readings, draw_trajectories
from rebody.report.page.drawing import CURVES, panel
from rebody.tasks import Family

KIND = "kind of task"
"""The figure of latents."""


def settings_of(results: Results) -> dict[str, Any]:
    """Who was put to the test, and where."""
    names = (
        "robot",
        "agent",
        "inference",
        "tracker",
        "control_dt",
        "stride",
        "horizon",
        "thesis",
        "sharpened",
        "frozen",
    )
    seconds = max(episode.time_s[-1] for episode in results.episodes)
    seeds = len({episode.seed for episode in results.episodes})
    law = {"law": results.law.in_short} if results.law else {}
    return {name: getattr(results, name) for name in names} | law | {
        "episodes": len(results.episodes), "seeds": seeds, "seconds": seconds,
    }  # fmt: skip


def figures_of(results: Results) -> dict[str, Markup]:
    """What the robot did, family by family, and what was believed in the end, if its latents fit together."""
    motion = {
        f"what the robot did: {family.name}": panel(partial(draw_trajectories, episodes=results.of(family.name)))
        for family in results.families
    }
    lengths = {len(latent) for episode in results.episodes for latent in episode.latent}
    kind = {KIND: panel(partial(draw_beliefs, results=results))} if len(lengths) == 1 and lengths != {0} else {}
    return motion | kind | {"target": panel(partial(draw_readings, results=results))}


def legend(compared: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Line and colour of each evaluation, beside the figures: there is room for long names, and for many."""
    return dict(zip(compared, cycle(product(("solid", "dashed", "dotted"), CURVES)), strict=False))


def errors_of(compared: Mapping[str, Results]) -> dict[str, Markup]:
    """Of each family, which share of episodes has at most which error, a line per evaluation."""
    families = {family.name: family for results in compared.values() for family in results.families}
    return {f"final errors: {name}": panel(partial(_errors, family, compared)) for name, family in families.items()}


def _errors(family: Family, compared: Mapping[str, Results], axes: Axes) -> None:
    for name, (line, colour) in legend(compared).items():
        if episodes := compared[name].of(family.name):
            draw_errors(axes, episodes, color=colour, ls=line)
    axes.set(title=f"{family.name}: final errors", xlabel=f"final error [{family.unit}]")
    axes.set(ylabel="episodes with at most this error [%]", ylim=(0, 103))
