"""Statistics with their bootstrap intervals."""

from typing import Any

import numpy as np
import scipy.stats

RESAMPLES = 2000


def regret(returns: np.ndarray) -> float:
    """Of rows (return, oracle return)."""
    reached, possible = returns.sum(axis=0)
    return float((possible - reached) / abs(possible))


def percentile_95(values: np.ndarray) -> float:
    """The 95th percentile."""
    return float(np.percentile(values, 95))


def with_interval(values: Any, statistic: Any) -> dict[str, float]:
    """A statistic over the rows of `values`, with its 95 % bootstrap interval (percentile method)."""
    values = np.asarray(values, float)
    value = float(statistic(values))
    if len(values) < 2 or np.ptp(values, axis=0).max() == 0:
        return {"value": value, "low": value, "high": value}
    rows = np.arange(len(values))
    interval = scipy.stats.bootstrap(
        (rows,),
        lambda chosen: statistic(values[chosen]),
        n_resamples=RESAMPLES,
        vectorized=False,
        method="percentile",
        rng=np.random.default_rng(0),
    ).confidence_interval
    return {"value": value, "low": float(interval.low), "high": float(interval.high)}
