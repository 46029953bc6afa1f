"""Where a log's positions count from."""

from dataclasses import replace

from rebody.evaluation.logs.file import COLUMNS, Log
from rebody.inference.contract import Contract

HORIZONTAL = ("x", "y")
"""Fields that may begin anywhere; a height or a pitch is told from the rest pose."""
FARTHEST_M = 15.0
"""Distance [m] for fields that the module learned no goals of."""


def begun_at_zero(log: Log, contract: Contract) -> Log:
    """The log with positions that begin farther from 0 than any goal of the training counted from the first row."""
    fields, notes = dict(log.fields), list(log.notes)
    for field in HORIZONTAL:
        farthest = farthest_asked(contract).get(field, FARTHEST_M)
        if field not in fields or abs(start := float(fields[field][0])) <= farthest:
            continue
        fields[field] = fields[field] - start
        notes.append(
            f"{COLUMNS[field]} begins at {start:g} m, and the module knows places up to {farthest:g} m: positions and "
            f"targets are counted from the first row, {start:g} m less than in the log."
        )
    return replace(log, fields=fields, notes=tuple(notes))


def farthest_asked(contract: Contract) -> dict[str, float]:
    """The largest target of the training, either way, of each field that tasks were about [m, m/s, rad]."""
    asked: dict[str, float] = {}
    for family in contract.families:
        for field, largest in zip(family.quantity.components, family.range.largest, strict=True):
            asked[field] = max(largest, asked.get(field, 0.0))
    return asked
