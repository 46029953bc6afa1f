"""Which part lost what: inference, high level and bridge, or tracker."""

from collections import Counter, defaultdict
from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from rich.table import Table

from rebody.evaluation.episode import EpisodeResult
from rebody.evaluation.evaluate import evaluate, take_yardsticks
from rebody.evaluation.results import Results
from rebody.evaluation.trial import POINT_MASS, Trial
from rebody.tasks import Family
from rebody.tasks.family_set import fit
from rebody.tasks.figures import LAST_S
from rebody.tasks.task_file import TaskSpec
from rebody.types import DECISION_DT

LADDER = {
    "oracle": "the tracker, told the target",
    "bayes": "+ finding out, with the exact posterior",
    "readout": "+ the module, its target read from the belief",
    "reuse": "+ the high level and the bridge",
}
"""Agents that differ by one part each, in the order in which parts are added."""
EXACT = "exact"
WALKING_LADDER = {
    EXACT: "the navigator, told the target",
    **LADDER,
    "oracle": "+ the walking policy",
    "reuse": "+ the imagined policy and the bridge",
}
"""Of a robot that walks already; the first agent is the oracle on a body that goes exactly as its joystick says."""
IDLE = "idle"
"""Stands beside the ladder: what nobody's part could lose."""
PARTS = ("wrong base task", "wrong slot", "target read", "high level", "tracker")
WALKING_PARTS = (*PARTS[:-1], "navigator", "walking policy")
SLOT_FROM = 20
"""Decisions after which base task and slot count as right or wrong."""
_LAST = round(LAST_S / DECISION_DT)


@dataclass(frozen=True)
class Shares:
    """Where one episode of `reuse` stands at its end, in the unit of its family."""

    base_task_right: bool
    slot_right: bool
    read: float
    """Between the target and what is read from the belief."""
    high_level: float
    """Between that and the subgoal."""
    tracker: float
    """Between the subgoal and what is reached."""

    @property
    def culprit(self) -> str:
        """The part that an error is due to."""
        if not self.base_task_right:
            return "wrong base task"
        if not self.slot_right:
            return "wrong slot"
        parts = {"target read": self.read, "high level": self.high_level, "tracker": self.tracker}
        return max(parts, key=lambda part: parts[part])


@dataclass(frozen=True)
class Diagnosis:
    """One set of tasks, done by agents that differ by one part each."""

    results: dict[str, Results]
    """By agent: `reuse` at least, which is enough to see where it stands at its end."""

    @property
    def ladder(self) -> dict[str, str]:
        """Its agents, in the order in which parts are added."""
        return WALKING_LADDER if EXACT in self.results else LADDER

    @property
    def is_complete(self) -> bool:
        """Whether every agent of the ladder is there, so that it shows what each part costs."""
        return self.results.keys() >= LADDER.keys()

    @property
    def families(self) -> list[Family]:
        """Those of the tasks."""
        return self.results["reuse"].families

    def culprits(self) -> Counter[str]:
        """How many episodes of `reuse` are out of tolerance by which part's fault."""
        episodes = self.results["reuse"].episodes
        exact = self.results[EXACT].episodes if EXACT in self.results else [None] * len(episodes)
        both = [(e, x) for e, x in zip(episodes, exact, strict=True) if e.final_error > e.last_family.tolerance]
        return Counter(_culprit(episode, on_exact) for episode, on_exact in both)

    def base_task_known(self) -> float:
        """Share of episodes of `reuse` whose base task is read rightly once something is known."""
        return float(np.mean([e.base_task_right()[SLOT_FROM - 1] for e in self.results["reuse"].episodes]))

    def wrong_slots(self) -> float:
        """Share of decisions of `reuse` whose subgoal is in another slot than the task's, once something is known."""
        of_episode = [
            np.not_equal(e.subgoal_family, e.active_family)[SLOT_FROM:] for e in self.results["reuse"].episodes
        ]
        return float(np.mean(of_episode))

    def lost(self) -> dict[str, float]:
        """Mean return that each part costs; they add up to the return of `reuse`."""
        returns = [float(np.mean([e.return_ for e in self.results[agent].episodes])) for agent in self.ladder]
        return {
            agent: after - before for agent, before, after in zip(self.ladder, [0.0, *returns], returns, strict=False)
        }


def diagnose(trial: Trial, specs: list[TaskSpec], seeds: int, tell: Callable[[str], None]) -> Diagnosis:
    """Every agent of the ladder on every task; `tell` hears which one is next. RebodyError as `evaluate`."""
    results, yardsticks = {}, None
    if trial.robot is not None and trial.robot.walking is not None:
        tell(EXACT)
        results[EXACT] = evaluate(replace(trial, agent="oracle", goes_exactly=True), specs, seeds)
    for agent in LADDER:
        tell(agent)
        yardsticks = yardsticks or take_yardsticks(trial, specs, seeds)
        results[agent] = evaluate(replace(trial, agent=agent), specs, seeds, yardsticks)
    results[IDLE] = evaluate(replace(trial, agent=IDLE), specs, seeds, yardsticks)
    return Diagnosis(results)


def diagnoses_among(results: Iterable[Results]) -> list[Diagnosis]:
    """Of evaluations that are there already: one diagnosis per set of tasks that `reuse` did on a robot."""
    comparable: defaultdict[Hashable, dict[str, Results]] = defaultdict(dict)
    for result in results:
        if result.agent in LADDER and result.robot != POINT_MASS and not result.thesis:
            comparable[_conditions(result)].setdefault(result.agent, result)
    return [Diagnosis(of) for of in comparable.values() if "reuse" in of]


def _conditions(results: Results) -> Hashable:
    """What agents of one ladder have in common."""
    tasks = tuple((e.task, e.seed, len(e.time_s)) for e in results.episodes)
    parts = (results.robot, results.inference, results.tracker, *sorted(results.frozen.values()))
    return parts, results.law, results.stride, results.horizon, tasks


def _culprit(episode: EpisodeResult, on_exact: EpisodeResult | None) -> str:
    """Between subgoal and motion it is the navigator's fault where a body that follows it exactly is off, too."""
    culprit = shares_of(episode).culprit
    if culprit != "tracker" or on_exact is None:
        return culprit
    return "navigator" if on_exact.final_error > episode.last_family.tolerance else "walking policy"


def shares_of(episode: EpisodeResult) -> Shares:
    """Means over the last 2 s; a velocity's are of its mean, so that a gait does not count."""
    family, target = episode.last_family, np.array(episode.active_target[-1])
    asked = [given or [np.nan] * family.size for given in episode.subgoal[-_LAST:]]
    read, subgoal, reached = (_mean(of, family) for of in (episode.inferred_target[-_LAST:], asked, episode.reached))
    distance = family.quantity.distance
    return Shares(
        base_task_right=bool(episode.base_task_right()[-1]),
        slot_right=episode.subgoal_family[-1] == family.name,
        read=float(distance(read, target)),
        high_level=float(distance(subgoal, read)),
        tracker=float(distance(reached, subgoal)),
    )


def _mean(vectors: Any, family: Family) -> Float[np.ndarray, " size"]:
    """Of the last ones, those of another family's size cut or filled up."""
    return np.mean([fit(np.array(vector), family.size) for vector in vectors[-_LAST:]], axis=0)


def diagnosis_tables(diagnosis: Diagnosis) -> list[Table]:
    """What each part costs, if the ladder is complete, and where `reuse` stands at the end."""
    ladder = [_ladder(diagnosis)] if diagnosis.is_complete else []
    return [*ladder, _standing(diagnosis), _failures(diagnosis)]


def _ladder(diagnosis: Diagnosis) -> Table:
    table = Table(title="what each part costs", title_justify="left")
    families = diagnosis.families
    table.add_column("")
    for family in families:
        table.add_column(f"{family.name}: median error \\[{family.unit}]", justify="right")
    table.add_column("fell \\[%]", justify="right")
    table.add_column("return that it costs", justify="right")
    lost = diagnosis.lost()
    for agent, what in (diagnosis.ladder | {IDLE: "idle: stands still"}).items():
        if agent not in diagnosis.results:
            continue
        summary = diagnosis.results[agent].summary
        errors = [f"{summary['families'][family.name]['median_error']['value']:.3f}" for family in families]
        cost = f"{lost[agent]:.2f}" if agent in lost else "-"
        table.add_row(what, *errors, f"{100 * summary['fell']['value']:.1f}", cost)
    return table


def _standing(diagnosis: Diagnosis) -> Table:
    table = Table(title="`reuse` in the last 2 s, medians", title_justify="left")
    for column in ("", "read - target", "subgoal - read", "reached - subgoal", "base task right [%]", "slot right [%]"):
        table.add_column(column.replace("[", "\\["), justify="right")
    for family in diagnosis.families:
        of = [shares_of(episode) for episode in diagnosis.results["reuse"].of(family.name)]
        medians = (np.median([getattr(s, part) for s in of]) for part in ("read", "high_level", "tracker"))
        right = (100 * np.mean([getattr(s, part) for s in of]) for part in ("base_task_right", "slot_right"))
        cells = [*(f"{value:.3f}" for value in medians), *(f"{value:.1f}" for value in right)]
        table.add_row(f"{family.name} \\[{family.unit}]", *cells)
    table.caption = (
        f"after {SLOT_FROM} decisions: base task right in {100 * diagnosis.base_task_known():.1f} % of episodes, "
        f"wrong slots from then on {100 * diagnosis.wrong_slots():.2f} %"
    )
    return table


def _failures(diagnosis: Diagnosis) -> Table:
    table = Table(title="episodes of `reuse` out of tolerance, by the part to blame", title_justify="left")
    culprits = diagnosis.culprits()
    parts = WALKING_PARTS if EXACT in diagnosis.results else PARTS
    for part in parts:
        table.add_column(part, justify="right")
    table.add_row(*(str(culprits[part]) for part in parts))
    return table
