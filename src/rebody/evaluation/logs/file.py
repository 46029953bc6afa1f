"""Log files: a CSV with a row per sample."""

import csv
import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from rebody.errors import RebodyError
from rebody.types import DECISION_DT, RATE_OF

TIME, REWARD = "time_s", "reward"
COLUMNS = {
    "x": "position_m",
    "y": "position_y_m",
    "z": "position_z_m",
    "pitch": "pitch_rad",
    "vx": "velocity_m_s",
    "vy": "velocity_y_m_s",
    "vz": "velocity_z_m_s",
    "pitch_rate": "pitch_rate_rad_s",
}
"""The column of each field of the global state."""
LONGEST_GAP_S = 0.3
"""Without a sample for longer than this nobody knows what the robot did: positions would be guesses."""
JITTER = 0.05
"""A logger's clock may tick so much slower than it should, as a share."""


@dataclass(frozen=True)
class Log:
    """The columns that a module needs."""

    path: Path
    time_s: Float[np.ndarray, " row"]
    """Ascending."""
    fields: dict[str, Float[np.ndarray, " row"]]
    """Of the global state, by their names there (m, rad, m/s, rad/s)."""
    reward: Float[np.ndarray, " row"]
    """Of the step that led to each row."""
    ignored: tuple[str, ...]
    """Columns of the file that nothing looks at."""


def read_log(path: Path, fields: tuple[str, ...]) -> Log:
    """What a module that sees these fields needs of a log; RebodyError that says what is wrong with it and where."""
    table = _Table.read(path)
    used = _used_fields(table, fields)
    columns = {name: table.column(name) for name in (TIME, *(COLUMNS[field] for field in used), REWARD)}
    _check_time(table, columns[TIME])
    _check_reward(table, columns[REWARD])
    ignored = tuple(name for name in table.names if name and name not in columns)
    return Log(path, columns[TIME], {field: columns[COLUMNS[field]] for field in used}, columns[REWARD], ignored)


@dataclass(frozen=True)
class _Table:
    """A CSV file as text."""

    path: Path
    names: list[str]
    rows: list[list[str]]
    lines: list[int]
    """Of each row: where it stands in the file."""

    @classmethod
    def read(cls, path: Path) -> "_Table":
        """RebodyError where the file is no table."""
        try:
            with path.open(newline="", encoding="utf-8-sig") as file:
                reader = csv.reader(file, strict=True)
                numbered = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if row]
        except FileNotFoundError:
            raise RebodyError(f"there is no log {path}.") from None
        except (UnicodeDecodeError, csv.Error) as error:
            raise RebodyError(f"{path} is not a CSV file ({error}).") from None
        if not numbered:
            raise RebodyError(f"{path} is empty. A log begins with a line that names its columns.")
        (_, names), *numbered = numbered
        if twice := [name for name, times in Counter(names).items() if name and times > 1]:
            raise RebodyError(f"{path} has the column {twice[0]} more than once: which is it?")
        table = cls(path, names, [row for _, row in numbered], [line for line, _ in numbered])
        for i, row in enumerate(table.rows):
            if len(row) != len(names):
                raise table.error(i, f"{len(row)} cells where the first line names {len(names)} columns")
        return table

    def column(self, name: str) -> Float[np.ndarray, " row"]:
        """Its numbers; RebodyError if one is none, or not finite."""
        place = self.names.index(name)
        numbers = [_number(row[place]) for row in self.rows]
        for i, number in enumerate(numbers):
            if not math.isfinite(number):
                raise self.error(i, f"{name} is '{self.rows[i][place]}', not a finite number")
        return np.array(numbers, float)

    def error(self, row: int, says: str) -> RebodyError:
        """About one row."""
        return RebodyError(f"{self.path}, line {self.lines[row]}: {says}.")


def decisions_within(time: Float[np.ndarray, " row"]) -> int:
    """How many whole decisions the times span [s]."""
    return int((time[-1] - time[0]) / DECISION_DT + 1e-6) if len(time) else 0  # 0.3 / 0.1 is 2.9999999999999996


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _used_fields(table: _Table, fields: tuple[str, ...]) -> list[str]:
    """The fields, and what is displaced where it is there: a velocity is better told by positions."""
    needed = [TIME, *(COLUMNS[field] for field in fields), REWARD]
    if missing := [name for name in needed if name not in table.names]:
        raise RebodyError(
            f"{table.path} lacks {', '.join(missing)}. The module needs the columns {', '.join(needed)}; there are "
            f"{', '.join(table.names)}. The first line names the columns, with commas between them."
        )
    positions = [RATE_OF[field] for field in fields if field in RATE_OF]
    return [*fields, *(p for p in positions if p not in fields and COLUMNS[p] in table.names)]


def _check_time(table: _Table, time: Float[np.ndarray, " row"]) -> None:
    steps = np.diff(time)
    if (backward := np.flatnonzero(steps <= 0)).size:
        row = int(backward[0]) + 1
        raise table.error(row, f"{TIME} is {time[row]:g} after {time[row - 1]:g}; time must ascend")
    if steps.size and (usual := np.median(steps)) > DECISION_DT * (1 + JITTER):
        raise RebodyError(
            f"{table.path} has a row every {usual:.3g} s; a decision takes {DECISION_DT} s and needs at least one "
            f"({TIME} is in seconds)."
        )
    if steps.size and (gap := steps.max()) > LONGEST_GAP_S:
        row = int(np.argmax(steps)) + 1
        raise table.error(row, f"no sample for {gap:.3g} s before this one; at most {LONGEST_GAP_S} s may pass")
    if decisions_within(time) < 2:
        raise RebodyError(
            f"{table.path} is too short: {len(time)} rows over {steps.sum():.3g} s, and a belief needs at least two "
            f"decisions of {DECISION_DT} s ({TIME} is in seconds)."
        )


def _check_reward(table: _Table, reward: Float[np.ndarray, " row"]) -> None:
    if (positive := np.flatnonzero(reward > 0)).size:
        row = int(positive[0])
        raise table.error(row, f"{REWARD} is {reward[row]:g}; rewards are -|error|, never above 0")
