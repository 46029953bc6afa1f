"""Sufficient statistics of weighted points, kept so that adding and merging never cancels.

Instead of sums of x and x x^T each component has its mean and the scatter about it; two sets add up by the
parallel-variance formula (Chan et al. 1979). Sums of squares would lose everything where a cluster lies a million
of its widths from the origin.
"""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

Array = Float[np.ndarray, "..."]


@dataclass(frozen=True)
class Statistics:
    """Of every component; a leading axis may count batches."""

    count: Array  # [*batches, K]: sum of responsibilities
    mean: Array  # [*batches, K, D]
    scatter: Array  # [*batches, K, D, D], or [*batches, K, D] for a diagonal covariance
    entropy: Array  # [*batches, K]: -sum r ln r

    def __getitem__(self, index) -> "Statistics":
        """Of some components (last axis of `count`), or of some batches."""
        return Statistics(*(getattr(self, field.name)[index] for field in fields(self)))


def combine(statistics: Statistics) -> Statistics:
    """All sets along the first axis as one."""
    count = statistics.count.sum(0)
    share = np.divide(statistics.count, count, out=np.zeros_like(statistics.count), where=count > 0)
    mean = np.sum(share[..., None] * statistics.mean, axis=0)
    offset = statistics.mean - mean
    if statistics.scatter.ndim == statistics.mean.ndim:
        between = offset**2 * statistics.count[..., None]
    else:
        between = offset[..., :, None] * offset[..., None, :] * statistics.count[..., None, None]
    return Statistics(count, mean, np.sum(statistics.scatter + between, axis=0), statistics.entropy.sum(0))


def concatenate(parts: list[Statistics], axis: int) -> Statistics:
    """Sets side by side: `axis` 0 puts components (or batches) behind one another, 1 components of batches."""
    return Statistics(
        *(np.concatenate([getattr(part, field.name) for part in parts], axis) for field in fields(Statistics))
    )


def stack(parts: list[Statistics]) -> Statistics:
    """Sets as batches on a new first axis."""
    return Statistics(*(np.stack([getattr(part, field.name) for part in parts]) for field in fields(Statistics)))
