"""Tasks that change in mid-episode: how soon the new one is known, and done."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.statistics import with_interval


def summarise_changes(episodes: Sequence[EpisodeResult]) -> dict[str, Any] | None:
    """Medians [s] over the episodes whose base task changes, with 95 % intervals; None if there are none.

    `noticed_s`: from the change until family and direction are read rightly. `recovered_s`: until the error is within
    tolerance. What never comes to pass counts as long as the episode lasted on.
    """
    changed = [episode for episode in episodes if _changes_base_task(episode)]
    if not changed:
        return None
    noticed = [episode.seconds_until(episode.base_task_right()) for episode in changed]
    recovered = [episode.arrived_s for episode in changed]
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
