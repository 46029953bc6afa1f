"""What an evaluation leaves behind: the versioned JSON that others read."""

import json
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from rebody.agents.rollout import Episodes
from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.summary import summarise
from rebody.store.files import written_whole
from rebody.tasks import FAMILIES
from rebody.tasks.figures import final_error, final_squared_error, ripple
from rebody.tasks.task_file import TaskSpec
from rebody.types import DECISION_DT, AnyArray, Task

VERSION = 2


@dataclass(frozen=True)
class Results:
    """One evaluation."""

    robot: str
    agent: str
    inference: str
    tracker: str | None
    control_dt: float
    stride: int | str
    horizon: int
    thesis: bool
    frozen: dict[str, str]
    """SHA-256 of the inference module and of the toy's policy, the same before the episodes and after them."""
    episodes: list[EpisodeResult]

    def of(self, family: str) -> list[EpisodeResult]:
        """Episodes whose last task is of that family."""
        return [episode for episode in self.episodes if episode.active_family[-1] == family]

    @property
    def families(self) -> list[str]:
        """Names of those that episodes end with."""
        return sorted({episode.active_family[-1] for episode in self.episodes})

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Statistics per family, with 95 % bootstrap intervals."""
        return summarise(self.episodes)

    def to_json(self) -> dict[str, Any]:
        """The whole file."""
        names = [field.name for field in fields(self) if field.name != "episodes"]
        return {
            "version": VERSION,
            **{name: getattr(self, name) for name in names},
            "decision_dt": DECISION_DT,
            "episodes": [episode.to_json() for episode in self.episodes],
            "summary": self.summary,
        }


def save_results(results: Results, path: Path) -> None:
    """Write the JSON, whole or not at all."""
    with written_whole(path) as unfinished:
        unfinished.write_text(json.dumps(results.to_json(), allow_nan=False))


def episode_results(
    specs: list[TaskSpec],
    seeds: Int[np.ndarray, " episode"],
    tasks: Task,
    episodes: Episodes,
    read: tuple[Int[AnyArray, "time episode"], Float[AnyArray, "time episode"]],
    cluster: Int[np.ndarray, "time episode"],
    returns: dict[str, Float[np.ndarray, " episode"] | None],
) -> list[EpisodeResult]:
    """One result per episode, from arrays [time, episode]; `read` is what the probe says, `cluster` the mixture's
    component, `returns` has those of the oracle and of an idle agent where there are any.
    """
    names = np.array([family.name for family in FAMILIES])
    inferred_family, inferred_target = (np.asarray(part) for part in read)
    state = episodes.state
    last = Task(tasks.family[-1], tasks.target[-1])
    errors, squared_errors, ripples = final_error(last, state), final_squared_error(last, state), ripple(state)
    quantities = {family.quantity.name: family.quantity.read(state)[..., 0] for family in FAMILIES}
    results = []
    for i, spec in enumerate(specs):
        results.append(
            EpisodeResult(
                family=spec.family,
                target=spec.target,
                seed=int(seeds[i]),
                switch=None if spec.switch is None else asdict(spec.switch),
                time_s=_floats(DECISION_DT * np.arange(1, len(state.x) + 1)),
                quantities={quantity: _floats(values[:, i]) for quantity, values in quantities.items()},
                reward=_floats(episodes.reward[:, i]),
                active_family=names[np.asarray(tasks.family[:, i])].tolist(),
                active_target=_floats(tasks.target[:, i]),
                inferred_family=names[inferred_family[:, i]].tolist(),
                inferred_target=_floats(inferred_target[:, i]),
                cluster=cluster[:, i].tolist(),
                latent=[_floats(row) for row in episodes.belief.mean[:, i]],
                subgoal_family=names[np.asarray(episodes.subgoal.slot[:, i])].tolist(),
                subgoal=[None if np.isnan(value) else value for value in _floats(episodes.subgoal.value[:, i])],
                fell=bool(episodes.fell[i]),
                return_=float(np.sum(episodes.reward[:, i])),
                oracle_return=_return_of(returns["oracle"], i),
                idle_return=_return_of(returns["idle"], i),
                final_error=float(errors[i]),
                final_squared_error=float(squared_errors[i]),
                ripple_m_s=float(ripples[i]),
            )
        )
    return results


def _return_of(returns: Float[np.ndarray, " episode"] | None, episode: int) -> float | None:
    return None if returns is None else float(returns[episode])


def _floats(values: Any) -> list[float]:
    """As JSON holds them: five decimals are 10 micrometres."""
    return [round(float(value), 5) for value in np.asarray(values)]
