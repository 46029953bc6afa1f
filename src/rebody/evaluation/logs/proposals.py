"""What would explain the rewards of a log that no known task explains."""

import numpy as np

from rebody.agents.unknown import LEAST_EXPLAINED
from rebody.evaluation.logs.file import Log
from rebody.evaluation.logs.resample import resample
from rebody.inference.proposal import Proposal, propose
from rebody.types import ANGLES, GlobalState, global_state

SHOWN = 3
"""Proposals, at most."""


def proposals(log: Log, rewards: int) -> list[Proposal]:
    """The likeliest few that explain enough of the last so many rewards, by all columns of the log that say what a body
    did."""
    decisions = resample(log, tuple(log.fields))
    first = np.flatnonzero(np.isfinite(decisions.reward))[-rewards]
    # entry 0 of states is where the first decision began
    fields = {field: values[first + 1 :] for field, values in decisions.fields.items()}
    found = propose(_wrapped(fields), decisions.reward[first:])
    return [each for each in found if each.explained >= LEAST_EXPLAINED][:SHOWN]


def _wrapped(fields: dict[str, np.ndarray]) -> GlobalState:
    angles = {field: np.angle(np.exp(1j * fields[field])) for field in ANGLES if field in fields}
    return global_state(**(fields | angles))
