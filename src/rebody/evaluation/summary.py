"""From episodes to the few numbers of a table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.stats

from rebody.tasks.figures import tolerance

if TYPE_CHECKING:
    from rebody.evaluation.results import EpisodeResult

RESAMPLES = 2000


def summarise(episodes: Sequence["EpisodeResult"]) -> dict[str, Any]:
    """Per family of the last task: statistics with 95 % intervals; beside them regret and falls of all."""
    families = sorted({episode.active_family[-1] for episode in episodes})
    return {
        "episodes": len(episodes),
        "fell": with_interval([episode.fell for episode in episodes], np.mean),
        "regret": _regret(episodes),
        "families": {
            family: _of_family(family, [e for e in episodes if e.active_family[-1] == family]) for family in families
        },
    }


def _of_family(family: str, episodes: Sequence["EpisodeResult"]) -> dict[str, Any]:
    errors = np.array([episode.final_error for episode in episodes])
    base_task_right = [_base_task_right(episode) for episode in episodes]
    return {
        "episodes": len(episodes),
        "median_error": with_interval(errors, np.median),
        "p95_error": with_interval(errors, percentile_95),
        "within_tolerance": with_interval(errors <= tolerance(family), np.mean),
        "final_mse": with_interval([episode.final_squared_error for episode in episodes], np.mean),
        "ripple": with_interval([episode.ripple_m_s for episode in episodes], np.median),
        "base_task_right": with_interval(base_task_right, np.mean),
    }


def _base_task_right(episode: "EpisodeResult") -> bool:
    """Whether family and sign are read rightly from the last belief."""
    right_family = episode.inferred_family[-1] == episode.active_family[-1]
    return right_family and episode.inferred_target[-1] * episode.active_target[-1] > 0


def _regret(episodes: Sequence["EpisodeResult"]) -> dict[str, float] | None:
    """(oracle return - return) / |oracle return|, each summed over episodes."""
    if any(episode.oracle_return is None for episode in episodes):
        return None
    returns = np.array([[episode.return_, episode.oracle_return] for episode in episodes], float)
    return with_interval(returns, regret)


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
