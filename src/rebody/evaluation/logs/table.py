"""A CSV file as text: its columns' names, then row after row."""

import csv
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rebody.errors import RebodyError
from rebody.store.files import DATA, check_file

UNREADABLE = "\ufffd"
"""Takes the place of bytes that are not UTF-8: in a row they damage one cell."""


@dataclass(frozen=True)
class Table:
    """An open file."""

    path: Path
    names: list[str]
    """Of the columns; empty where a column has none."""
    rows: Iterator[tuple[int, list[str]]]
    """Line number and cells; blank lines are left out."""


@contextmanager
def open_table(path: Path, separator: str) -> Iterator[Table]:
    """RebodyError where the file is no table, also while its rows are read."""
    check_log(path)
    with path.open(newline="", encoding="utf-8-sig", errors="replace") as file:
        reader = csv.reader(file, delimiter=separator, skipinitialspace=True, strict=True)
        stripped = ((reader.line_num, [cell.strip() for cell in row]) for row in reader)
        rows = ((line, cells) for line, cells in stripped if any(cells))
        try:
            _, names = next(rows, (0, []))
            _check_names(path, names)
            yield Table(path, names, rows)
        except csv.Error as error:
            raise RebodyError(f"{path} is not a CSV file (line {reader.line_num}: {error}).") from None


def _check_names(path: Path, names: list[str]) -> None:
    if not names:
        raise RebodyError(f"{path} is empty. A log begins with a line that names its columns.")
    if any(UNREADABLE in name for name in names):
        raise RebodyError(f"{path} is not a CSV file in UTF-8: its first line is no text.")
    if twice := [name for name, times in Counter(names).items() if name and times > 1]:
        raise RebodyError(f"{path} has the column {twice[0]} more than once: which is it?")


def check_log(path: Path) -> None:
    """RebodyError where there is no regular file, or one that is too large."""
    try:
        check_file(path, DATA)
    except FileNotFoundError:
        raise RebodyError(f"there is no log {path}.") from None
