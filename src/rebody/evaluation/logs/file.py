"""Log files: a CSV with a row per sample."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from rebody.errors import RebodyError
from rebody.evaluation.logs.format import UNIT_NAMES, Format, check_format
from rebody.evaluation.logs.rows import Rows, in_order, read_rows
from rebody.evaluation.logs.table import Table, open_table
from rebody.evaluation.logs.ticks import COARSEST_S, LONGEST_GAP_S, gaps_in, heard
from rebody.inputs import LARGEST
from rebody.types import DECISION_DT, RATE_OF

TIME, REWARD = "time_s", "reward"
COLUMNS = {
    "x": "position_m",
    "y": "position_y_m",
    "z": "position_z_m",
    "roll": "roll_rad",
    "pitch": "pitch_rad",
    "yaw": "yaw_rad",
    "vx": "velocity_m_s",
    "vy": "velocity_y_m_s",
    "vz": "velocity_z_m_s",
    "roll_rate": "roll_rate_rad_s",
    "pitch_rate": "pitch_rate_rad_s",
    "yaw_rate": "yaw_rate_rad_s",
}
"""The column of each field of the global state."""
LONGEST_BREAK_S = 3600.0
"""A longer gap is one between two logs, or a wrong time stamp."""


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
    notes: tuple[str, ...] = ()
    """Sentences about what was left out or changed."""


def read_log(
    path: Path,
    fields: tuple[str, ...],
    form: Format | None = None,
    skip_bad_rows: bool = False,
    also: tuple[str, ...] = (),
) -> Log:
    """What a module that sees these fields needs of a log, and what there is of others; RebodyError that says what is
    wrong with it and where.

    `skip_bad_rows` leaves damaged rows out and accepts gaps, and says so in the log's notes.
    """
    form = form or Format()
    check_format(path, TIME, (*(COLUMNS[field] for field in fields), REWARD), form)
    with open_table(path, form.separator) as table:
        used = _used_fields(table, fields, form, also)
        names = (TIME, *(COLUMNS[field] for field in used), REWARD)
        ignored = tuple(name for name in table.names if name and name not in names)
        rows = in_order(read_rows(table, names, form, skip_bad_rows), skip_bad_rows)
    time_s, time_notes = _seconds(rows, form)
    _check_time(rows, time_s, form, skip_bad_rows)
    notes = ([f"{rows.summary()}."] if rows.left_out else []) + time_notes
    columns = {field: rows.columns[COLUMNS[field]] for field in used}
    return Log(path, time_s, columns, rows.columns[REWARD], ignored, tuple(notes))


def _used_fields(table: Table, fields: tuple[str, ...], form: Format, also: tuple[str, ...]) -> list[str]:
    """The fields, and what is displaced where it is there: a velocity is better told by positions. Then the others."""
    needed = [TIME, *(COLUMNS[field] for field in fields), REWARD]
    if missing := [name for name in needed if name not in table.names]:
        raise RebodyError(
            f"{table.path} lacks {', '.join(missing)}. The module needs the columns {', '.join(needed)}; there are "
            f"{', '.join(table.names)}. The first line names the columns, with {form.delimiter}s between them."
        )
    others = dict.fromkeys((*(RATE_OF[field] for field in fields if field in RATE_OF), *also))
    return [*fields, *(field for field in others if field not in fields and COLUMNS[field] in table.names)]


def _seconds(rows: Rows, form: Format) -> tuple[Float[np.ndarray, " row"], list[str]]:
    """Time stamps in seconds, large ones such as Unix epochs from the first row on, and sentences about them."""
    time = rows.time
    notes, start = [], 0.0
    if len(time) and abs(time[0]) / form.per_second > LARGEST:
        start = time[0]
        notes.append(f"{TIME} begins at {start / form.per_second:.15g} s; times are counted from there.")
    time_s = (time - start) / form.per_second
    gaps = gaps_in(time_s)
    if gaps.size:
        lost = float(np.diff(time_s)[gaps - 1].sum())
        plural = "s" if gaps.size > 1 else ""
        notes.append(
            f"{gaps.size} gap{plural} of more than {LONGEST_GAP_S} s without a sample, {lost:.3g} s in all: the "
            "belief hears nothing there."
        )
    return time_s, notes


def _check_time(rows: Rows, time_s: Float[np.ndarray, " row"], form: Format, skip_bad_rows: bool) -> None:
    """RebodyError where rows are too far apart, or too few."""
    steps = np.diff(time_s)
    unit = f"{TIME} is in {UNIT_NAMES[form.time_unit]}"
    if steps.size and (usual := np.median(steps)) > COARSEST_S:
        raise RebodyError(
            f"{rows.path} has a row every {usual:.3g} s; a decision takes {DECISION_DT} s and needs at least one "
            f"({unit}; --time-unit changes it)."
        )
    longest = LONGEST_BREAK_S if skip_bad_rows else LONGEST_GAP_S
    if long := [row for row in gaps_in(time_s) if steps[row - 1] > longest]:
        row = int(long[0])
        hint = "split the log there" if skip_bad_rows else "--skip-bad-rows goes on after it, and hears nothing in it"
        raise rows.error(
            row, f"no sample for {steps[row - 1]:.3g} s before this one; at most {longest:g} s may pass; {hint}"
        )
    if heard(time_s).sum() < 2:
        left_out = f" ({rows.summary()})" if rows.left_out else ""
        raise RebodyError(
            f"{rows.path} is too short: {len(time_s)} rows over {steps.sum():.3g} s{left_out}, and a belief needs at "
            f"least two decisions of {DECISION_DT} s without a gap ({unit})."
        )
