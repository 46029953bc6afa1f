"""The rows of a log as numbers; damaged ones are errors, or are left out and counted."""

import bisect
import math
from array import array
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.errors import RebodyError
from rebody.evaluation.logs.cells import is_not_finite, number
from rebody.evaluation.logs.format import Format
from rebody.evaluation.logs.table import Table
from rebody.inputs import LARGEST

LATEST_S = 1e11
"""No time stamp is later: Unix epochs come to 2e9, and more digits would not tell rows apart."""
SHOWN = 40
"""Characters of a faulty cell that an error shows."""
LEAVE_OUT = "--skip-bad-rows leaves such rows out"


@dataclass(frozen=True)
class Rows:
    """Those that can be used."""

    path: Path
    line: Int[np.ndarray, " row"]
    """Where each stands in the file."""
    columns: dict[str, Float[np.ndarray, " row"]]
    """Time first, in the unit of the file."""
    left_out: Counter[str]
    """How many others there were, by what was wrong with them."""

    @property
    def time(self) -> Float[np.ndarray, " row"]:
        """In the unit of the file."""
        return next(iter(self.columns.values()))

    def summary(self) -> str:
        """What was left out."""
        rows = self.left_out.total() + len(self.line)
        kinds = ", ".join(f"{times} {kind}" for kind, times in self.left_out.items())
        return f"skipped {self.left_out.total()} of {rows} rows: {kinds}"

    def error(self, row: int, says: str) -> RebodyError:
        """About one row."""
        return row_error(self.path, int(self.line[row]), says)


def row_error(path: Path, line: int, says: str) -> RebodyError:
    """About a line of the file."""
    return RebodyError(f"{path}, line {line}: {says}.")


class _BadRow(Exception):
    def __init__(self, kind: str, says: str):
        self.kind, self.says = kind, says


def read_rows(table: Table, names: tuple[str, ...], form: Format, skip_bad_rows: bool) -> Rows:
    """The columns of these names, time first; RebodyError for a damaged row unless such rows are left out."""
    places = {name: table.names.index(name) for name in names}
    limits = [LATEST_S * form.per_second, *(LARGEST for _ in names[1:])]
    lines, columns, left_out = array("q"), [array("d") for _ in names], Counter[str]()
    for line, cells in table.rows:
        try:
            _check_width(table.names, cells, form)
            numbers = [
                _number(name, cells[place], limit, form)
                for (name, place), limit in zip(places.items(), limits, strict=True)
            ]
        except _BadRow as bad:
            if not skip_bad_rows:
                raise row_error(table.path, line, f"{bad.says}; {LEAVE_OUT}") from None
            left_out[bad.kind] += 1
            continue
        lines.append(line)
        for column, value in zip(columns, numbers, strict=True):
            column.append(value)
    arrays = (np.array(column, float) for column in columns)
    return Rows(table.path, np.array(lines, np.int64), dict(zip(names, arrays, strict=True)), left_out)


def in_order(rows: Rows, skip_bad_rows: bool) -> Rows:
    """Rows whose time ascends; RebodyError for one that does not, unless such rows are left out."""
    time = rows.time
    if not (backward := np.flatnonzero(np.diff(time) <= 0)).size:
        return rows
    if not skip_bad_rows:
        row, name = int(backward[0]) + 1, next(iter(rows.columns))
        raise rows.error(row, f"{name} is {time[row]:.13g} after {time[row - 1]:.13g}; time must ascend; {LEAVE_OUT}")
    kept = _ascending(time)
    repeated = int(np.isin(time[~kept], time[kept]).sum())
    kinds = {"with a repeated time stamp": repeated, "with a time stamp out of order": int((~kept).sum()) - repeated}
    left_out = rows.left_out + Counter(kinds)
    return Rows(rows.path, rows.line[kept], {name: all_[kept] for name, all_ in rows.columns.items()}, left_out)


def _ascending(time: Float[np.ndarray, " row"]) -> Bool[np.ndarray, " row"]:
    """The most rows that ascend, so that one stamp that jumps ahead does not cost all after it.

    The longest ascending subsequence: for each length, the row with the earliest time that so many rows can end with.
    """
    ends, end_times, before = [], [], np.full(len(time), -1)
    for row, moment in enumerate(time.tolist()):
        length = bisect.bisect_left(end_times, moment)
        if length == len(ends):
            ends.append(row)
            end_times.append(moment)
        elif moment < end_times[length]:
            ends[length], end_times[length] = row, moment
        else:
            continue  # of repeated stamps the first is kept
        before[row] = ends[length - 1] if length else -1
    kept, row = np.zeros(len(time), bool), ends[-1]
    while row >= 0:
        kept[row], row = True, int(before[row])
    return kept


def _check_width(names: list[str], cells: list[str], form: Format) -> None:
    """A delimiter at the end of lines makes an empty cell or name more."""
    needed = max(place + 1 for place, name in enumerate(names) if name)
    if needed <= len(cells) and not any(cells[len(names) :]):
        return
    is_split = form.delimiter == "comma" and len(cells) > len(names)
    hint = " (decimal commas need another delimiter between cells)" if is_split else ""
    raise _BadRow(
        "with a wrong number of cells", f"{len(cells)} cells where the first line names {len(names)} columns{hint}"
    )


def _number(name: str, cell: str, limit: float, form: Format) -> float:
    value = number(cell, form.decimal_comma)
    if abs(value) <= limit:
        return value
    shown = cell if len(cell) <= SHOWN else f"{cell[: SHOWN - 3]}..."
    if math.isnan(value):
        kind = "not finite" if is_not_finite(cell) else "unreadable"
        raise _BadRow(kind, f"{name} is '{shown}', not a finite number")
    raise _BadRow("too large", f"{name} is '{shown}', larger than any that can be ({limit:g} either way)")
