"""What training measured, out of whatever a log or a checkpoint holds: columns of numbers, and notes on the rest."""

import csv
import io
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

Log = Mapping[str, Float[np.ndarray, " iteration"]]
"""A column per measurement, NaN where nothing was measured; `iteration` ascends."""

ITERATION = "iteration"
LARGEST = 1e100
"""Beyond it either way axes overflow, and so does what divides by less than its inverse."""


def read_csv(text: str) -> tuple[Log, list[str]]:
    """A log's columns, and notes on what it holds beside numbers."""
    try:
        rows = [row for row in csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline="")) if row]
    except csv.Error as error:
        return {}, [f"The log is no CSV table ({error}), so no curves are drawn."]
    if not rows:
        return {}, []
    names, cells = rows[0], rows[1:]
    twice = [name for name, times in Counter(names).items() if times > 1]
    notes = [f"Columns that the log has more than once, the last of which is shown: {_listed(twice)}."] if twice else []
    log, more = _columns(names, [dict(zip(names, row, strict=False)) for row in cells])
    notes += more
    if ITERATION not in log:
        notes.append("The log has no column `iteration`: its rows are counted.")
    elif not (np.diff(log[ITERATION], prepend=-np.inf) > 0).all():
        notes.append("The log's column `iteration` does not ascend: its rows are counted.")
        del log[ITERATION]
    return _counted(len(cells)) | log, notes


def read_meta(meta: Any) -> tuple[dict[str, Any], Log, list[str]]:
    """A checkpoint's settings and columns, and notes on what it lacks."""
    meta = meta if isinstance(meta, dict) else {}
    settings, history = meta.get("settings"), meta.get("history")
    notes = []
    if not isinstance(settings, dict):
        settings, notes = {}, ["The checkpoint tells no settings."]
    if not isinstance(history, list):
        history = []
        notes.append("The checkpoint tells no measurements.")
    rows = [row for row in history if isinstance(row, dict)]
    if len(rows) < len(history):
        notes.append(f"Entries of the checkpoint that hold no measurements: {len(history) - len(rows)}.")
    names = [name for name in dict.fromkeys(name for row in rows for name in row) if name != ITERATION]
    log, more = _columns(names, rows)
    return settings, _counted(len(rows)) | log, notes + more


def _counted(rows: int) -> dict[str, np.ndarray]:
    return {ITERATION: np.arange(1.0, rows + 1)}


def _columns(names: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> tuple[dict[str, np.ndarray], list[str]]:
    """As numbers, NaN where there is none; a note on the columns that hold something else."""
    log, odd = {}, []
    for name in dict.fromkeys(names):
        cells = [row.get(name) for row in rows]
        numbers = [_number(cell) for cell in cells]
        log[name] = np.array([math.nan if number is None else number for number in numbers], float)
        if faulty := sum(number is None for number in numbers):
            odd.append(f"{name} ({faulty})")
    return log, [f"Cells that are no number that can be drawn, and are left out: {_listed(odd)}."] if odd else []


def _number(cell: Any) -> float | None:
    """NaN where nothing was measured; None for what is no number, or one too large."""
    if cell is None or cell == "":
        return math.nan
    try:
        value = float(cell)
    except (TypeError, ValueError, OverflowError):
        return None
    return None if abs(value) > LARGEST else value


def _listed(names: Sequence[str], most: int = 10) -> str:
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more
