"""What can be paid at all: bounds of a family's reward, by any target or by targets of a range."""

import itertools
import math

import numpy as np
from jaxtyping import Float

from rebody.ranges import Box
from rebody.tasks.family import Family
from rebody.tasks.quantities import length

_FAR = 1e9
"""Stands for an endless target: relative rewards tend to -1 there."""

Vector = Float[np.ndarray, " size"]


def payable(family: Family, moved: tuple[Vector, Vector], targets: Box | None = None) -> tuple[float, float]:
    """The worst and the best reward of a decision, over the targets of a range; None for any target.

    `moved` are the ends between which the family's quantity was meanwhile [m, m/s, rad]. In each number of the target,
    rewards are monotonic between its ends, the ends of `moved`, 0 and the family's floor either way: so one of these is
    the worst. Of an angle, which may be near a target the other way round, the bounds are wider than they need be.
    """
    law, ends = family.reward_law, np.sort(np.stack(moved), axis=0)
    first, last = (np.full(family.size, -_FAR), np.full(family.size, _FAR))
    if targets is not None:
        first, last = np.asarray(targets.low, float), np.asarray(targets.high, float)
    asked = np.array(list(itertools.product(*_turning_points(family, ends, first, last))))
    corners = np.array(list(itertools.product(*ends.T)))
    differences = asked[:, None] - corners
    distances = length(np.where(family.quantity.wraps, np.clip(differences, -math.pi, math.pi), differences))
    pay = law.pay(distances, np.maximum(length(asked), family.floor)[:, None])
    is_met = any(family.quantity.wraps) or bool(np.all(np.maximum(ends[0], first) <= np.minimum(ends[1], last)))
    best = law.pay(np.zeros(1), np.array([family.floor])) if is_met else pay
    return float(np.min(pay)), float(np.max(best))


def _turning_points(family: Family, ends: Float[np.ndarray, "2 size"], first: Vector, last: Vector) -> list[Vector]:
    """Of each number of a target, where the reward may turn."""
    return [
        np.clip([low, high, *of_moved, 0.0, -family.floor, family.floor], low, high)
        for low, high, of_moved in zip(first, last, ends.T, strict=True)
    ]
