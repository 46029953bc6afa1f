"""What can be paid at all: bounds of a family's reward, by any target or by targets of a range."""

import itertools
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from rebody.ranges import Box
from rebody.tasks.family import Family
from rebody.tasks.quantities import length

_FAR = 1e9
"""Stands for an endless target: relative rewards tend to -1 there."""

Vector = Float[np.ndarray, " size"]
Ends = Float[np.ndarray, "2 size"]


def payable(family: Family, moved: tuple[Vector, Vector], targets: Box | None = None) -> tuple[float, float]:
    """The worst and the best reward of a decision, over the targets of a range; None for any target.

    `moved` are the ends between which the family's quantity was meanwhile [m, m/s, rad]. Of an angle, which may be near
    a target the other way round, of vectors, and of laws that measure along the target, the bounds are wider than they
    need be.
    """
    law, ends = family.reward_law, np.sort(np.stack(moved), axis=0)
    first, last = (np.full(family.size, -_FAR), np.full(family.size, _FAR))
    if targets is not None:
        first, last = np.asarray(targets.low, float), np.asarray(targets.high, float)
    if law.measure == "along":
        return _of_ways(family, ends, first, last)
    lowest, highest = (_of_numbers if family.size == 1 else _of_vectors)(family, ends, first, last)
    is_met = any(family.quantity.wraps) or bool(np.all(np.maximum(ends[0], first) <= np.minimum(ends[1], last)))
    best = float(law.pay(np.zeros(1), np.array([family.floor])).max()) if is_met else highest
    return lowest, best


def _of_numbers(family: Family, ends: Ends, first: Vector, last: Vector) -> tuple[float, float]:
    """Rewards are monotonic between the ends of the targets, those of `moved`, half a turn from these, 0 and the
    family's floor either way: so one of these is the worst.
    """
    turns = (0.0, -math.pi, math.pi) if any(family.quantity.wraps) else (0.0,)
    around = [end + turn for end in ends for turn in turns]
    asked = np.clip([first, last, *around, *(np.full(1, x) for x in (0.0, -family.floor, family.floor))], first, last)
    distances = length(_apart(family, asked[:, None], ends[None]))
    pay = family.reward_law.pay(distances, np.maximum(length(asked), family.floor)[:, None])
    return float(np.min(pay)), float(np.max(pay))


def _of_vectors(family: Family, ends: Ends, first: Vector, last: Vector) -> tuple[float, float]:
    """By the length of a target, since the distance from one is between the difference of lengths and their sum.

    Each end of what is left is monotonic in it between the shortest and the longest, the family's floor, and the length
    from where on the difference of lengths says more than the gap between targets and `moved`.
    """
    corners = np.array(list(itertools.product(*ends.T)))
    farthest = _apart(family, np.stack([first, last])[:, None], ends[None])
    most = float(length(np.abs(farthest).max(axis=(0, 1))))
    gap = float(np.linalg.norm(np.maximum(np.maximum(first - ends[1], ends[0] - last), 0.0)))
    reach = float(np.linalg.norm(corners, axis=-1).max())
    shortest = float(np.linalg.norm(np.clip(0.0, first, last)))
    longest = float(np.linalg.norm(np.maximum(np.abs(first), np.abs(last))))
    lengths = np.clip([shortest, longest, family.floor, reach + gap], shortest, longest)
    scale, law = np.maximum(lengths, family.floor), family.reward_law
    most_of_length = family.size**0.5 if law.measure == "l1" else 1.0
    lowest = law.pay(most_of_length * np.minimum(lengths + reach, most), scale)
    highest = law.pay(np.maximum(lengths - reach, gap), scale)
    return float(np.min(lowest)), float(np.max(highest))


def _of_ways(family: Family, ends: Ends, first: Vector, last: Vector) -> tuple[float, float]:
    """Along whichever way, no more counts than there is in all; an angle is told within half a turn of its target."""
    largest = np.maximum(np.abs(first), np.abs(last))
    reached = np.where(family.quantity.wraps, math.pi + largest, np.abs(ends).max(axis=0))
    reach, shortest, longest = length(reached), length(np.clip(0.0, first, last)), length(largest)
    scale = np.maximum([shortest, longest], family.floor)
    pay = family.reward_law.pay(np.array([[-reach], [reach]]), scale)
    return float(np.min(pay)), float(np.max(pay))


def _apart(family: Family, asked: Any, reached: Any) -> Any:
    differences = asked - reached
    return np.where(family.quantity.wraps, np.clip(differences, -math.pi, math.pi), differences)
