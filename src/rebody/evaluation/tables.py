"""Tables for the terminal."""

from collections.abc import Sequence
from typing import Any

from rich.table import Table

from rebody.evaluation.results import Results

FIGURES = (
    ("median error", "median_error"),
    ("95th percentile", "p95_error"),
    ("within tolerance", "within_tolerance"),
    (r"within tolerance after \[s]", "arrived_s"),
    (r"ripple \[m/s]", "ripple"),
)
"""Of each family: what it is called, and where it stands in the summary."""
CHANGES = ((r"base task right after \[s]", "noticed_s"), (r"within tolerance after \[s]", "recovered_s"))
"""Of tasks that change in mid-episode."""
SHARES = ("within_tolerance", "fell")
CAPTION = (
    r"value \[95 % bootstrap interval over tasks]; seeds: smallest and largest median of an evaluation seed; "
    "share: (return - idle) / (oracle - idle)"
)


def summary_table(results: Sequence[Results]) -> Table:
    """A column per evaluation, a row per figure, each with its 95 % interval."""
    summaries = [result.summary for result in results]
    table = Table(caption=CAPTION, caption_justify="left")
    table.add_column("")
    for result in results:
        table.add_column(f"{result.robot}, {result.agent}", justify="right")
    if any(result.law for result in results):
        table.add_row("law", *(result.law.in_short if result.law else "each family's own" for result in results))
    for family in {family.name: family for result in results for family in result.families}.values():
        ofs = [summary["families"].get(family.name, {}) for summary in summaries]
        table.add_row(f"{family.name}: episodes", *(str(of.get("episodes", 0)) for of in ofs))
        for name, key in FIGURES:
            unit = rf" \[{family.unit}]" if key.endswith("_error") else ""
            table.add_row(f"{family.name}: {name}{unit}", *(_cell(key, of.get(key)) for of in ofs))
        if any(len(of.get("median_error_by_seed", ())) > 1 for of in ofs):
            table.add_row(rf"{family.name}: seeds \[{family.unit}]", *(_spread(of) for of in ofs))
    changes = [summary["changes"] for summary in summaries]
    if any(changes):
        for name, key in CHANGES:
            table.add_row(f"change: {name}", *(_cell(key, change and change[key]) for change in changes))
    for key in ("fell", "regret", "share"):
        table.add_row(key, *(_cell(key, summary[key]) for summary in summaries))
    return table


def _spread(of: dict[str, Any]) -> str:
    medians = of["median_error_by_seed"].values() if of else ()
    return f"{min(medians):.3f} to {max(medians):.3f}" if medians else "-"


def _cell(key: str, figure: dict[str, Any] | None) -> str:
    if figure is None:
        return "-"
    value, low, high = (
        f"{100 * figure[end]:.1f}" if key in SHARES else f"{figure[end]:.3f}" for end in ("value", "low", "high")
    )
    interval = "" if low == high else rf" \[{low}, {high}]"
    return f"{value}{interval}" + (" %" if key in SHARES else "")
