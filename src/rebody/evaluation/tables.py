"""Tables for the terminal and for Markdown."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from rebody.evaluation.results import Results
from rebody.tasks import FAMILIES

COLUMNS = (
    ("median error", "median_error"),
    ("95th percentile", "p95_error"),
    ("within tolerance", "within_tolerance"),
    ("ripple m/s", "ripple"),
)


def summary_table(results: Sequence[Results]) -> Table:
    """One row per evaluation and family, each figure with its 95 % interval."""
    table = Table(caption="value [95 % bootstrap interval over episodes]", caption_justify="left")
    for column in ("robot", "agent", "family", "episodes", *(name for name, _ in COLUMNS), "fell", "regret"):
        table.add_column(column, justify="left" if column in ("robot", "agent", "family") else "right")
    for result in results:
        summary = result.summary
        for family, figures in summary["families"].items():
            unit = next(f.unit for f in FAMILIES if f.name == family)
            table.add_row(
                result.robot,
                result.agent,
                f"{family} [{unit}]".replace("[", r"\["),
                str(figures["episodes"]),
                *(_with_interval(figures[key], percent=key == "within_tolerance") for _, key in COLUMNS),
                _with_interval(summary["fell"], percent=True),
                _with_interval(summary["regret"]),
            )
    return table


def _with_interval(figure: dict[str, Any] | None, *, percent: bool = False) -> str:
    if figure is None:
        return "-"
    show = (lambda x: f"{100 * x:.1f} %") if percent else (lambda x: f"{x:.3f}")
    if figure["low"] == figure["high"]:
        return show(figure["value"])
    return f"{show(figure['value'])} \\[{show(figure['low'])}, {show(figure['high'])}]"
