"""The figures by which an episode is judged: one definition each, on NumPy arrays."""

import numpy as np
from jaxtyping import Float

from rebody.tasks.families import FAMILIES
from rebody.types import DECISION_DT

LAST_S = 2.0
"""The final error is a mean over this many seconds at the end."""
MEAN_S = 1.0
"""Velocities are judged by the mean over this many seconds."""

Series = Float[np.ndarray, " time"]


def final_error(family: str, target: float, position: Series, start: float = 0.0) -> float:
    """Mean over the last 2 s of |y - target| [m, m/s]; a velocity is the displacement over 1 s.

    `position` is x [m] after each decision; `start` is x before the first.
    """
    last = round(LAST_S / DECISION_DT)
    return float(np.abs(_judged(family, position, start)[-last:] - target).mean())


def final_squared_error(family: str, target: float, position: Series, velocity: Series) -> float:
    """Squared error at the last decision [m^2, (m/s)^2], to compare with ReMAP."""
    achieved = position[-1] if family == "goal" else velocity[-1]
    return float((achieved - target) ** 2)


def ripple(position: Series, velocity: Series) -> float:
    """Std over the last 2 s of the 0.1 s velocity about its 1 s mean [m/s]."""
    last = round(LAST_S / DECISION_DT)
    return float(np.std((velocity - _mean_velocity(position, 0.0))[-last:]))


def tolerance(family: str) -> float:
    """Within which final error an episode counts as solved [m, m/s]."""
    return next(f.tolerance for f in FAMILIES if f.name == family)


def _judged(family: str, position: Series, start: float) -> Series:
    return position if family == "goal" else _mean_velocity(position, start)


def _mean_velocity(position: Series, start: float) -> Series:
    steps = round(MEAN_S / DECISION_DT)
    before = np.concatenate([np.full(steps, start), position])[: len(position)]
    return (position - before) / MEAN_S
