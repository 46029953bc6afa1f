"""How a log is written, and which options read a file that is written in another way."""

import csv
import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from rebody.errors import RebodyError
from rebody.evaluation.logs.cells import number
from rebody.evaluation.logs.table import check_log
from rebody.evaluation.logs.ticks import COARSEST_S

Delimiter = Literal["comma", "semicolon", "tab", "space"]
TimeUnit = Literal["s", "ms", "us", "ns"]

SEPARATORS: dict[Delimiter, str] = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
PER_SECOND: dict[TimeUnit, float] = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
UNIT_NAMES: dict[TimeUnit, str] = {"s": "seconds", "ms": "milliseconds", "us": "microseconds", "ns": "nanoseconds"}
FINEST_S = 0.002
"""Time stamps are taken for those of another unit only where rows then follow each other by at least this: a row every
1.0 may be a second as well as a millisecond."""
HEAD = 100_000
"""Characters at the start of a file that tell how it is written."""


@dataclass(frozen=True)
class Format:
    """How the table and its numbers are written."""

    delimiter: Delimiter = "comma"
    decimal_comma: bool = False
    time_unit: TimeUnit = "s"

    @property
    def separator(self) -> str:
        """Between two cells."""
        return SEPARATORS[self.delimiter]

    @property
    def per_second(self) -> float:
        """Units of the time stamps in a second."""
        return PER_SECOND[self.time_unit]

    @property
    def options(self) -> str:
        """Of the command line."""
        options = [f"--delimiter {self.delimiter}"] if self.delimiter != "comma" else []
        options += ["--decimal-comma"] if self.decimal_comma else []
        options += [f"--time-unit {self.time_unit}"] if self.time_unit != "s" else []
        return " ".join(options)


def check_format(path: Path, time: str, others: tuple[str, ...], given: Format) -> None:
    """RebodyError that names the options, where the columns of these names can only be read in another format."""
    check_log(path)
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        text = file.read(HEAD)
    whole = text.splitlines()[: -1 if len(text) == HEAD else None]
    lines = [line for line in whole if line.strip()]
    delimiter = _delimiter(lines, (time, *others), given)
    columns = _columns(lines, SEPARATORS[delimiter])
    cells = [cell for name in (time, *others) for cell in columns.get(name, ())]
    decimal_comma = _has_decimal_commas(cells, given)
    step = _usual_step(columns.get(time, ()), decimal_comma)
    found = Format(delimiter, decimal_comma, _time_unit(step, given))
    if found == given:
        return
    signs = [f"{delimiter}s between its columns"] if delimiter != given.delimiter else []
    if decimal_comma != given.decimal_comma:
        signs.append("decimal commas" if decimal_comma else "decimal points")
    if found.time_unit != given.time_unit:
        signs.append(f"times that look like {UNIT_NAMES[found.time_unit]} (a row every {step:.3g})")
    how = f"with {found.options}" if found.options else f"without {given.options}"
    raise RebodyError(f"{path} has {', '.join(signs)}. Read it {how}.")


def _columns(lines: list[str], separator: str) -> dict[str, tuple[str, ...]]:
    """Cells by the names in the first line."""
    rows = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    columns = itertools.zip_longest(*([cell.strip() for cell in row] for row in rows), fillvalue="")
    return {name: tuple(cells) for name, *cells in columns}


def _delimiter(lines: list[str], names: tuple[str, ...], given: Format) -> Delimiter:
    """The one that separates most of the names; the given one where none does better."""

    def separated(delimiter: Delimiter) -> tuple[int, bool]:
        return len(_columns(lines[:1], SEPARATORS[delimiter]).keys() & set(names)), delimiter == given.delimiter

    return max(SEPARATORS, key=separated)


def _has_decimal_commas(cells: list[str], given: Format) -> bool:
    commas, points = (
        sum(sign in cell and np.isfinite(number(cell, sign == ",")) for cell in cells) for sign in (",", ".")
    )
    return given.decimal_comma if commas == points else bool(commas > points)


def _usual_step(cells: tuple[str, ...], decimal_comma: bool) -> float:
    """Between the time stamps of two rows, in the file's unit; 0 where none ascends."""
    steps = np.diff([number(cell, decimal_comma) for cell in cells])
    ascending = steps[steps > 0]
    return float(np.median(ascending)) if ascending.size else 0.0


def _time_unit(step: float, given: Format) -> TimeUnit:
    """Another than the given one only where rows would be too far apart to be read."""
    if step / given.per_second <= COARSEST_S:
        return given.time_unit
    for unit, per_second in PER_SECOND.items():
        if FINEST_S <= step / per_second <= COARSEST_S:
            return unit
    return given.time_unit
