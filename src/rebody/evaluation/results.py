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
from rebody.tasks import Family, FamilySet, Payment
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
    family_set: FamilySet
    """The families in play: the module's, then others that were asked for."""
    episodes: list[EpisodeResult]
    sharpened: bool = False
    """Whether the agent's beliefs were sharpened; files of earlier releases do not say, and there they were not."""
    law: Payment | None = None
    """How all tasks were paid; None for each family's own law, which is all that earlier releases knew."""

    def of(self, family: str) -> list[EpisodeResult]:
        """Episodes whose last task is of that family."""
        return [episode for episode in self.episodes if episode.active_family[-1] == family]

    @property
    def families(self) -> list[Family]:
        """Those that episodes end with."""
        ends = {episode.active_family[-1] for episode in self.episodes}
        return [family for family in self.family_set if family.name in ends]

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Statistics per family, with 95 % bootstrap intervals."""
        return summarise(self.episodes)

    def to_json(self) -> dict[str, Any]:
        """The whole file."""
        names = [field.name for field in fields(self) if field.name != "episodes"]
        return {
            "version": VERSION,
            **{name: getattr(self, name) for name in names if name not in ("family_set", "law")},
            "law": None if self.law is None else asdict(self.law),
            "families": [asdict(family) for family in self.family_set],
            "decision_dt": DECISION_DT,
            "episodes": [episode.to_json() for episode in self.episodes],
            "summary": self.summary,
        }


def save_results(results: Results, path: Path) -> None:
    """Write the JSON, whole or not at all."""
    with written_whole(path) as unfinished:
        unfinished.write_text(json.dumps(results.to_json(), allow_nan=False))


def episode_results(
    families: FamilySet,
    specs: list[TaskSpec],
    seeds: Int[np.ndarray, " episode"],
    tasks: Task,
    episodes: Episodes,
    read: tuple[Int[AnyArray, "time episode"], Float[AnyArray, "time episode axis"]],
    cluster: Int[np.ndarray, "time episode"],
    returns: dict[str, Float[np.ndarray, " episode"] | None],
) -> list[EpisodeResult]:
    """One result per episode, from arrays [time, episode]; `read` is what the probe says, `cluster` the mixture's
    component, `returns` has those of the oracle and of an idle agent where there are any.
    """
    state, last = episodes.state, Task(tasks.family[-1], tasks.target[-1])
    errors, ripples = final_error(families, last, state), ripple(state)
    squared_errors = final_squared_error(families, last, state)
    quantities = {family.quantity.name: np.asarray(family.quantity.read(state)) for family in families}
    results = []
    for i, spec in enumerate(specs):
        active_family, active_target = _tasks(families, tasks.family[:, i], tasks.target[:, i])
        inferred_family, inferred_target = _tasks(families, *(np.asarray(part)[:, i] for part in read))
        subgoal_family, subgoal = _tasks(families, episodes.subgoal.slot[:, i], episodes.subgoal.value[:, i])
        results.append(
            EpisodeResult(
                families=families,
                family=spec.family,
                target=list(spec.target),
                seed=int(seeds[i]),
                switch=None if spec.switch is None else asdict(spec.switch),
                time_s=_floats(DECISION_DT * np.arange(1, len(state.x) + 1)),
                quantities={name: _series(values[:, i]) for name, values in quantities.items()},
                reward=_floats(episodes.reward[:, i]),
                active_family=active_family,
                active_target=active_target,
                inferred_family=inferred_family,
                inferred_target=inferred_target,
                cluster=cluster[:, i].tolist(),
                latent=[_floats(row) for row in episodes.belief.mean[:, i]],
                subgoal_family=subgoal_family,
                subgoal=[None if np.isnan(value).any() else value for value in subgoal],
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


def _tasks(families: FamilySet, family: Any, target: Any) -> tuple[list[str], list[list[float]]]:
    """Names and targets, each as long as its family has it, over time."""
    chosen = [families[index] for index in np.asarray(family)]
    vectors = [_floats(vector[: each.size]) for each, vector in zip(chosen, np.asarray(target), strict=True)]
    return [each.name for each in chosen], vectors


def _series(values: Float[np.ndarray, "time size"]) -> list[Any]:
    """Numbers where a quantity has one, else vectors."""
    return _floats(values[:, 0]) if values.shape[1] == 1 else [_floats(row) for row in values]


def _return_of(returns: Float[np.ndarray, " episode"] | None, episode: int) -> float | None:
    return None if returns is None else float(returns[episode])


def _floats(values: Any) -> list[float]:
    """As JSON holds them: five decimals are 10 micrometres."""
    return [round(float(value), 5) for value in np.asarray(values)]
