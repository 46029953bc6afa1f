"""From a log to decisions: what an encoder would have been shown."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rebody.evaluation.logs.file import Log
from rebody.evaluation.logs.ticks import heard, ticks_of
from rebody.types import ANGLES, DECISION_DT, RATE_OF


@dataclass(frozen=True)
class Decisions:
    """A run at the decisions' ticks; entry 0 of states is where the first decision began."""

    time_s: Float[np.ndarray, " decision_and_one"]
    fields: dict[str, Float[np.ndarray, " decision_and_one"]]
    """Of the global state; angles are not wrapped. Within gaps of the log they are guesses."""
    reward: Float[np.ndarray, " decision"]
    """NaN where nothing was heard: a gap of the log reaches into the decision."""


def resample(log: Log, fields: tuple[str, ...]) -> Decisions:
    """A log at ticks of 0.1 s from its first row on.

    Positions are interpolated, velocities are displacements between ticks, and rewards, which the steps to the rows
    were paid, are averaged over each decision. In gaps, where displacements say nothing, velocities are those logged:
    the one at the end of a gap is what the next decision begins with.
    """
    ticks, is_heard = ticks_of(log.time_s), heard(log.time_s)
    positions = {name: at_ticks(log, name, ticks) for name in log.fields if name not in RATE_OF}
    rates = {}
    for rate in (name for name in log.fields if name in RATE_OF):
        moved, position = mean_logged(log, rate, ticks), positions.get(RATE_OF[rate])
        if position is not None:
            moved = np.where(is_heard, np.diff(position) / DECISION_DT, moved)
        rates[rate] = np.concatenate([log.fields[rate][:1], moved])
    at = positions | rates
    reward = np.where(is_heard, _means(log, log.reward, ticks), np.nan)
    return Decisions(ticks, {name: at[name] for name in fields}, reward)


def at_ticks(log: Log, position: str, ticks: Float[np.ndarray, " tick"]) -> Float[np.ndarray, " tick"]:
    """A position between its samples [m, rad]."""
    samples = log.fields[position]
    return np.interp(ticks, log.time_s, np.unwrap(samples) if position in ANGLES else samples)


def mean_logged(log: Log, rate: str, ticks: Float[np.ndarray, " tick"]) -> Float[np.ndarray, " decision"]:
    """Mean of a logged velocity over each decision [m/s, rad/s]."""
    return _means(log, log.fields[rate], ticks)


def _means(
    log: Log, samples: Float[np.ndarray, " row"], ticks: Float[np.ndarray, " tick"]
) -> Float[np.ndarray, " decision"]:
    """Each sample lasts from the row before it to its own; so the means are exact where rows and ticks fall apart."""
    until = np.concatenate([[0.0], np.cumsum(samples[1:] * np.diff(log.time_s))])
    return np.diff(np.interp(ticks, log.time_s, until)) / DECISION_DT
