"""How honest beliefs are: how often the truth lies inside of the regions that they say it does."""

import numpy as np
import scipy.stats
from jaxtyping import Float

from rebody.inference.reader import PlaceReader
from rebody.tasks import FamilySet
from rebody.types import Belief, Task

REGIONS = (0.5, 0.9, 0.99)
"""Probabilities of the regions; an honest belief covers the truth as often."""
AFTER = (10, 20, 50, 110)
"""Decisions."""


def coverage(reader: PlaceReader, families: FamilySet, tasks: Task, belief: Belief) -> dict[str, float]:
    """Shares of the episodes whose true target lies in the region of each probability of its own family's Gaussian.

    Tasks and beliefs are [decision, episode].
    """
    figures = {}
    for i, (family, squared) in enumerate(
        zip(families, squared_deviations(reader, families, tasks, belief), strict=True)
    ):
        of_family = np.asarray(tasks.family[-1]) == i
        for decision in (each for each in AFTER if each <= len(squared)):
            off = squared[decision - 1, of_family]
            for region in REGIONS:
                inside = off <= scipy.stats.chi2.ppf(region, family.size)
                figures[f"{family.name} in {100 * region:.0f} % after {decision}"] = float(np.mean(inside))
    return figures


def squared_deviations(
    reader: PlaceReader, families: FamilySet, tasks: Task, belief: Belief
) -> list[Float[np.ndarray, "decision episode"]]:
    """Of each family, were it the one: squared distance of the true target in standard deviations of the belief."""
    of_each = []
    for family, (mean, deviation) in zip(families, reader.spreads(belief), strict=True):
        off = family.quantity.difference(np.asarray(mean, float), np.asarray(tasks.target, float)[..., : family.size])
        of_each.append(np.sum((np.asarray(off) / np.asarray(deviation, float)) ** 2, axis=-1))
    return of_each
