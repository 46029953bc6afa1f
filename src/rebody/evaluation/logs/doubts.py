"""What is odd about a log, though it can be read."""

import numpy as np
from jaxtyping import Float

from rebody.evaluation.logs.file import COLUMNS, Log
from rebody.evaluation.logs.origin import farthest_asked
from rebody.evaluation.logs.resample import Decisions, mean_logged
from rebody.inference.contract import Contract
from rebody.types import RATE_OF

DISAGREEMENT = 0.5
"""A logged velocity is doubted where it is off by more than this share of the displacement's."""
STILL = 0.1
"""Below this velocity [m/s, rad/s] nothing is made of a share."""
SLACK = 1.5
"""Bodies overshoot and gaits ripple: values are doubted beyond this many times what was asked in training."""
EPISODE_S = 20.0
"""Positions that a velocity leads to within an episode are known from training."""


def doubts(log: Log, decisions: Decisions, contract: Contract) -> list[str]:
    """Sentences for the user, none where all is plausible."""
    return [*_velocities_that_disagree(log, decisions), *_values_out_of_range(decisions, contract)]


def _velocities_that_disagree(log: Log, decisions: Decisions) -> list[str]:
    said = []
    for rate, position in RATE_OF.items():
        if not {rate, position} <= log.fields.keys() or rate not in decisions.fields:
            continue
        moved, logged = decisions.fields[rate][1:], mean_logged(log, rate, decisions.time_s)
        if _rms(logged - moved) > DISAGREEMENT * max(_rms(moved), STILL):
            said.append(
                f"{COLUMNS[rate]} says {_rms(logged):.3g} where {COLUMNS[position]} moves at {_rms(moved):.3g} per "
                "second (root mean squares); the position is believed. Are both in the units of their names?"
            )
    return said


def _values_out_of_range(decisions: Decisions, contract: Contract) -> list[str]:
    said = []
    for field, limit in _limits(contract).items():
        farthest = np.abs(decisions.fields[field]).max() if field in decisions.fields else 0.0
        if farthest > SLACK * limit:
            said.append(
                f"{COLUMNS[field]} reaches {farthest:.3g}, and the module learned {_ranges(contract)}: it has hardly "
                "seen such values. Is it in the unit of its name, and does it begin near 0?"
            )
    return said


def _limits(contract: Contract) -> dict[str, float]:
    """The farthest that tasks of the training led each field, either way [m, m/s, rad]."""
    asked = farthest_asked(contract)
    led = {RATE_OF[field]: EPISODE_S * speed for field, speed in asked.items() if field in RATE_OF}
    return asked | {field: asked.get(field, 0.0) + far for field, far in led.items()}


def _ranges(contract: Contract) -> str:
    said = []
    for family in contract.families:
        ends = zip(family.range.low, family.range.high, strict=True)
        said.append(f"{family.name} from " + " and ".join(f"{low:.3g} to {high:.3g}" for low, high in ends))
    return ", ".join(f"{each} {family.unit}" for each, family in zip(said, contract.families, strict=True))


def _rms(values: Float[np.ndarray, " n"]) -> float:
    return float(np.sqrt(np.mean(values**2)))
