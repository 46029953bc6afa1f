"""Tasks that change in mid-episode: how soon the new one is known, and done."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.statistics import with_interval
from rebody.types import DECISION_DT


def summarise_changes(episodes: Sequence[EpisodeResult]) -> dict[str, Any] | None:
    """Medians [s] over the episodes whose base task changes, with 95 % intervals; None if there are none.

    `noticed_s`: from the change until family and direction are read rightly. `recovered_s`: until the error is within
    tolerance. What never comes to pass counts as long as the episode lasted on.
    """
    changed = [episode for episode in episodes if _changes_base_task(episode)]
    if not changed:
        return None
    noticed = [_first_s(episode, episode.base_task_right()) for episode in changed]
    recovered = [_first_s(episode, _within_tolerance(episode)) for episode in changed]
    tasks = [episode.task for episode in changed]
    return {
        "episodes": len(changed),
        "noticed_s": with_interval(noticed, np.median, tasks),
        "recovered_s": with_interval(recovered, np.median, tasks),
    }


def _changes_base_task(episode: EpisodeResult) -> bool:
    if episode.active_family[0] != episode.active_family[-1]:
        return True
    first, last = episode.last_family.direction([episode.active_target[0], episode.active_target[-1]])
    return bool(first != last)


def _first_s(episode: EpisodeResult, holds: Bool[np.ndarray, " time"]) -> float:
    """Seconds from the change to the first decision after it at which something holds."""
    active = list(zip(episode.active_family, episode.active_target, strict=True))
    after = holds[active.index(active[-1]) :]
    decisions = np.argmax(after) + 1 if after.any() else len(after)
    return float(decisions * DECISION_DT)


def _within_tolerance(episode: EpisodeResult) -> Bool[np.ndarray, " time"]:
    return episode.missed() <= episode.last_family.tolerance
