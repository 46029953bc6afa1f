"""From episodes to the few numbers of a table."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rebody.evaluation.changes import summarise_changes
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.statistics import percentile_95, regret, share_of_oracle, with_interval


def summarise(episodes: Sequence[EpisodeResult]) -> dict[str, Any]:
    """Per family of the last task: statistics with 95 % intervals over tasks; beside them regret, falls and changes of
    all, and the same medians seed by seed.
    """
    tasks = [episode.task for episode in episodes]
    families = sorted({episode.active_family[-1] for episode in episodes})
    return {
        "episodes": len(episodes),
        "tasks": len(set(tasks)),
        "fell": with_interval([episode.fell for episode in episodes], np.mean, tasks),
        "regret": _regret(episodes),
        "share": _share(episodes),
        "changes": summarise_changes(episodes),
        "families": {family: _of_family([e for e in episodes if e.active_family[-1] == family]) for family in families},
    }


def _of_family(episodes: Sequence[EpisodeResult]) -> dict[str, Any]:
    errors, tasks = np.array([episode.final_error for episode in episodes]), [episode.task for episode in episodes]
    return {
        "episodes": len(episodes),
        "median_error": with_interval(errors, np.median, tasks),
        "p95_error": with_interval(errors, percentile_95, tasks),
        "within_tolerance": with_interval(errors <= episodes[0].last_family.tolerance, np.mean, tasks),
        "arrived_s": with_interval([episode.arrived_s for episode in episodes], np.median, tasks),
        "final_mse": with_interval([episode.final_squared_error for episode in episodes], np.mean, tasks),
        "ripple": with_interval([episode.ripple_m_s for episode in episodes], np.median, tasks),
        "base_task_right": with_interval([episode.base_task_right()[-1] for episode in episodes], np.mean, tasks),
        "median_error_by_seed": _by_seed(episodes),
    }


def _by_seed(episodes: Sequence[EpisodeResult]) -> dict[str, float]:
    """The median error of each evaluation seed: how much a start matters."""
    seeds = sorted({episode.seed for episode in episodes})
    return {str(seed): float(np.median([e.final_error for e in episodes if e.seed == seed])) for seed in seeds}


def _regret(episodes: Sequence[EpisodeResult]) -> dict[str, float] | None:
    """(oracle return - return) / |oracle return|, each summed over episodes."""
    if any(episode.oracle_return is None for episode in episodes):
        return None
    returns = np.array([[episode.return_, episode.oracle_return] for episode in episodes], float)
    if np.isclose(returns[:, 1].sum(), 0.0):
        return None
    return with_interval(returns, regret, [episode.task for episode in episodes])


def _share(episodes: Sequence[EpisodeResult]) -> dict[str, float] | None:
    """(return - idle return) / (oracle return - idle return), each summed over episodes."""
    if any(episode.oracle_return is None or episode.idle_return is None for episode in episodes):
        return None
    returns = np.array([[e.return_, e.oracle_return, e.idle_return] for e in episodes], float)
    if np.isclose(returns[:, 1].sum(), returns[:, 2].sum()):  # nothing to be gained
        return None
    return with_interval(returns, share_of_oracle, [episode.task for episode in episodes])
