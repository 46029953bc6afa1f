"""Figures of results and of what they tell together."""

from collections.abc import Mapping
from functools import partial
from itertools import cycle, product
from typing import Any

from markupsafe import Markup
from matplotlib.axes import Axes

from rebody.evaluation.results import Results
from rebody.report.figures import draw_beliefs, draw_errors, draw_readings, draw_trajectories
from rebody.report.page.drawing import panel
from rebody.report.style import BELIEF, IDLE, MOTION, ORACLE, TRUTH
from rebody.tasks import FAMILIES, Family


def settings_of(results: Results) -> dict[str, Any]:
    """Who was put to the test, and where."""
    names = ("robot", "agent", "inference", "tracker", "control_dt", "stride", "horizon", "thesis", "frozen")
    seconds = max(episode.time_s[-1] for episode in results.episodes)
    seeds = len({episode.seed for episode in results.episodes})
    return {name: getattr(results, name) for name in names} | {
        "episodes": len(results.episodes), "seeds": seeds, "seconds": seconds,
    }  # fmt: skip


def figures_of(results: Results) -> dict[str, Markup]:
    """What the robot did, family by family, and what was believed in the end."""
    motion = {
        f"what the robot did: {name}": panel(partial(draw_trajectories, episodes=results.of(name)))
        for name in results.families
    }
    return motion | {
        "kind of task": panel(partial(draw_beliefs, results=results)),
        "target": panel(partial(draw_readings, results=results)),
    }


def errors_of(compared: Mapping[str, Results]) -> dict[str, Markup]:
    """Of each family, which share of episodes has at most which error, a line per evaluation."""
    families = [family for family in FAMILIES if any(results.of(family.name) for results in compared.values())]
    return {f"final errors: {family.name}": panel(partial(_errors, family, compared)) for family in families}


def _errors(family: Family, compared: Mapping[str, Results], axes: Axes) -> None:
    styles = cycle(product(("-", "--", ":"), (MOTION, BELIEF, IDLE, ORACLE, TRUTH)))
    for (label, results), (line, colour) in zip(compared.items(), styles, strict=False):
        if episodes := results.of(family.name):
            draw_errors(axes, episodes, label=label.replace("$", r"\$"), color=colour, ls=line)  # no formula
    axes.set(title=f"{family.name}: final errors", xlabel=f"final error [{family.unit}]")
    axes.set(ylabel="episodes with at most this error [%]")
    axes.legend(frameon=False, fontsize=8, loc="upper left", bbox_to_anchor=(0.0, -0.2))  # names may be long
