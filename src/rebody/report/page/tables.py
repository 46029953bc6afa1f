"""Tables of the terminal, and of episodes, for a page."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rich.table import Table
from rich.text import Text

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.results import Results


@dataclass(frozen=True)
class PageTable:
    """Plain text, row by row."""

    title: str
    header: list[str]
    rows: list[list[str]]
    caption: str = ""


def from_terminal(table: Table, header: Sequence[str] | None = None) -> PageTable:
    """A table that is made for the terminal, with other words above its columns where some are given."""
    columns = [[_plain(cell) for cell in column.cells] for column in table.columns]
    return PageTable(
        title=_plain(table.title),
        header=list(header or (_plain(column.header) for column in table.columns)),
        rows=[list(row) for row in zip(*columns, strict=True)],
        caption=_plain(table.caption),
    )


def episodes_table(results: Results) -> PageTable:
    """A row per episode: the task, what was believed of it in the end, and how it went."""
    header = ("hidden task", "seed", "belief", "final error", "ripple [m/s]", "return", "oracle's return", "fell")
    return PageTable("", list(header), [_row(episode) for episode in results.episodes])


def _row(episode: EpisodeResult) -> list[str]:
    return [
        _task(episode),
        str(episode.seed),
        f"{episode.inferred_family[-1]} {vector(episode.inferred_target[-1], '+.3f')}",
        f"{episode.final_error:.3f} {episode.last_family.unit}",
        f"{episode.ripple_m_s:.3f}",
        f"{episode.return_:.2f}",
        "-" if episode.oracle_return is None else f"{episode.oracle_return:.2f}",
        "yes" if episode.fell else "no",
    ]


def _task(episode: EpisodeResult) -> str:
    text = f"{episode.family} {vector(episode.target)}"
    if episode.switch is None:
        return text
    at_s, family, target = (episode.switch.get(name) for name in ("at_s", "family", "target"))
    numbers = target if isinstance(target, list | tuple) else [target]  # a number in files of earlier releases
    if not all(isinstance(number, float | int) for number in (at_s, *numbers)):
        return f"{text}, then {episode.active_family[-1]} {vector(episode.active_target[-1])}"
    return f"{text}, from {at_s:g} s {family} {vector(numbers)}"


def vector(numbers: Sequence[Any], form: str = "+.3g") -> str:
    """Its numbers in words."""
    return ", ".join(format(number, form) for number in numbers)


def _plain(cell: object) -> str:
    """Without the terminal's marks."""
    return "" if cell is None else Text.from_markup(str(cell)).plain.replace("`", "")
