"""Statistics with their bootstrap intervals."""

import warnings
from collections import defaultdict
from collections.abc import Hashable, Iterable, Sequence
from typing import Any

import numpy as np
import scipy.stats

RESAMPLES = 2000


def regret(returns: np.ndarray) -> float:
    """Of rows (return, oracle return); NaN where nothing can be earned."""
    reached, possible = returns.sum(axis=0)
    return float((possible - reached) / abs(possible)) if possible else np.nan


def share_of_oracle(returns: np.ndarray) -> float:
    """Of rows (return, oracle return, idle return): how much of what knowing the task brings, 0 to 1; NaN where that is
    nothing.
    """
    reached, possible, nothing = returns.sum(axis=0)
    return float((reached - nothing) / (possible - nothing)) if possible != nothing else np.nan


def percentile_95(values: np.ndarray) -> float:
    """The 95th percentile."""
    return float(np.percentile(values, 95))


def with_interval(values: Any, statistic: Any, tasks: Sequence[Hashable] | None = None) -> dict[str, float]:
    """A statistic over the rows of `values`, with its 95 % bootstrap interval (percentile method).

    `tasks` says which task each row is of. Tasks are drawn anew, each with all of its rows: episodes of one task from
    several starts are no independent sample. By default every row is a task of its own.
    """
    values = np.asarray(values, float)
    value = float(statistic(values))
    of_tasks = _rows_of_tasks(range(len(values)) if tasks is None else tasks)
    if len(of_tasks) < 2 or np.ptp(values, axis=0).max() == 0:
        return {"value": value, "low": value, "high": value}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", scipy.stats.DegenerateDataWarning)  # some resamples have no value
        resampled = scipy.stats.bootstrap(
            (np.arange(len(of_tasks)),),
            lambda chosen: statistic(values[np.concatenate([of_tasks[i] for i in chosen])]),
            n_resamples=RESAMPLES,
            vectorized=False,
            method="percentile",
            rng=np.random.default_rng(0),
        )
    low, high = resampled.confidence_interval
    if np.isnan(low):  # of those that have a value
        low, high = np.nanpercentile(resampled.bootstrap_distribution, (2.5, 97.5))
    return {"value": value, "low": float(low), "high": float(high)}


def _rows_of_tasks(tasks: Iterable[Hashable]) -> list[list[int]]:
    rows: defaultdict[Hashable, list[int]] = defaultdict(list)
    for row, task in enumerate(tasks):
        rows[task].append(row)
    return list(rows.values())
