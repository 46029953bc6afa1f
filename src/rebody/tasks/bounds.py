"""What can be paid at all: bounds of a family's reward, by any target or by targets of a range."""

import math

import numpy as np

from rebody.tasks.families import Family, RewardForm

ANY = (-math.inf, math.inf)
"""Targets without a limit."""
_FAR = 1e9
"""Stands for an endless target: relative rewards tend to -1 there."""


def payable(
    family: Family, form: RewardForm, moved: tuple[float, float], targets: tuple[float, float] = ANY
) -> tuple[float, float]:
    """The worst and the best reward of a decision, over the targets from the first to the second.

    `moved` are the ends between which the family's quantity was meanwhile [m, m/s, rad]. In the target, rewards are
    monotonic between its ends, the ends of `moved`, 0 and the family's floor either way: so one of these is the worst.
    Of an angle, which may be near a target the other way round, the bounds are wider than they need be.
    """
    low, high = sorted(moved)
    first, last = (float(np.clip(end, -_FAR, _FAR)) for end in targets)
    asked = np.clip([first, last, low, high, 0.0, -family.floor, family.floor], first, last)
    errors = np.abs(asked[:, None] - [low, high])
    scale = np.maximum(np.abs(asked), family.floor)[:, None] if form == "relative" else 1.0
    pay = -errors / scale
    is_met = family.quantity.wraps or max(low, first) <= min(high, last)
    return float(pay.min()), 0.0 if is_met else float(pay.max())
