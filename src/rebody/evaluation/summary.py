"""From episodes to the few numbers of a table."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from rebody.evaluation.changes import base_task_right, summarise_changes
from rebody.evaluation.statistics import percentile_95, regret, with_interval
from rebody.tasks.figures import tolerance

if TYPE_CHECKING:
    from rebody.evaluation.results import EpisodeResult


def summarise(episodes: Sequence["EpisodeResult"]) -> dict[str, Any]:
    """Per family of the last task: statistics with 95 % intervals; beside them regret, falls and changes of all."""
    families = sorted({episode.active_family[-1] for episode in episodes})
    return {
        "episodes": len(episodes),
        "fell": with_interval([episode.fell for episode in episodes], np.mean),
        "regret": _regret(episodes),
        "changes": summarise_changes(episodes),
        "families": {
            family: _of_family(family, [e for e in episodes if e.active_family[-1] == family]) for family in families
        },
    }


def _of_family(family: str, episodes: Sequence["EpisodeResult"]) -> dict[str, Any]:
    errors = np.array([episode.final_error for episode in episodes])
    return {
        "episodes": len(episodes),
        "median_error": with_interval(errors, np.median),
        "p95_error": with_interval(errors, percentile_95),
        "within_tolerance": with_interval(errors <= tolerance(family), np.mean),
        "final_mse": with_interval([episode.final_squared_error for episode in episodes], np.mean),
        "ripple": with_interval([episode.ripple_m_s for episode in episodes], np.median),
        "base_task_right": with_interval([base_task_right(episode)[-1] for episode in episodes], np.mean),
    }


def _regret(episodes: Sequence["EpisodeResult"]) -> dict[str, float] | None:
    """(oracle return - return) / |oracle return|, each summed over episodes."""
    if any(episode.oracle_return is None for episode in episodes):
        return None
    returns = np.array([[episode.return_, episode.oracle_return] for episode in episodes], float)
    return with_interval(returns, regret)
