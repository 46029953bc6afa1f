"""The decisions that a log's time stamps span, and which of them nothing was heard in."""

import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.types import DECISION_DT

LONGEST_GAP_S = 0.3
"""Without a sample for longer than this nobody knows what the robot did: positions would be guesses."""
JITTER = 0.05
"""A logger's clock may tick so much slower than it should, as a share."""
COARSEST_S = DECISION_DT * (1 + JITTER)
"""Rows may usually be this far apart [s]: a decision needs at least one."""
EPSILON_S = 1e-6
"""Time stamps are decimals, and those of Unix epochs have no finer digits: 0.3 / 0.1 is 2.9999999999999996."""


def decisions_within(time_s: Float[np.ndarray, " row"]) -> int:
    """How many whole decisions the times span."""
    return int((time_s[-1] - time_s[0] + EPSILON_S) / DECISION_DT) if len(time_s) else 0


def ticks_of(time_s: Float[np.ndarray, " row"]) -> Float[np.ndarray, " decision_and_one"]:
    """When decisions begin and end, from the first row on [s]."""
    return time_s[0] + DECISION_DT * np.arange(decisions_within(time_s) + 1)


def gaps_in(time_s: Float[np.ndarray, " row"]) -> Int[np.ndarray, " gap"]:
    """The rows that gaps end with."""
    return np.flatnonzero(np.diff(time_s) > LONGEST_GAP_S + EPSILON_S) + 1


def heard(time_s: Float[np.ndarray, " row"]) -> Bool[np.ndarray, " decision"]:
    """Which decisions no gap reaches into: in the others states and rewards are not known."""
    is_heard = np.ones(decisions_within(time_s), bool)
    for row in gaps_in(time_s):
        begin, end = time_s[row - 1 : row + 1] - time_s[0]
        is_heard[int((begin + EPSILON_S) / DECISION_DT) : int(np.ceil((end - EPSILON_S) / DECISION_DT))] = False
    return is_heard
