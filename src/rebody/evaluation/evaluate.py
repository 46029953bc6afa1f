"""Every task once per evaluation seed, with the oracle's return beside it."""

import hashlib
import json
from dataclasses import dataclass, replace

import jax
import numpy as np
from jaxtyping import Float, Int

from rebody.agents.agent import Agent
from rebody.agents.build import (
    build_agent,
    slot_chooser,
)
from rebody.agents.clock import Clock, EvenClock, PredictedClock
from rebody.agents.controller import Controller, FlatController, TrackerController
from rebody.agents.parts import (
    Inference,
)
from rebody.agents.payday import first_payday
from rebody.agents.rollout import Episodes, Starts, rollout_on_robot, rollout_on_toy
from rebody.bodies import simulate
from rebody.bodies.walking.exact import ExactWalkers
from rebody.control.command import slots_among
from rebody.errors import RebodyError
from rebody.evaluation.results import Results, episode_results
from rebody.evaluation.trial import Trial, check_trial, without_slot
from rebody.jax_settings import own_jax_settings
from rebody.store import tree_hash
from rebody.tasks.task_file import TaskSpec, active_tasks
from rebody.types import DECISION_DT, Task

MOST_DECISIONS = 1_000_000
"""Of all episodes of an evaluation together, 5,000 of 20 s: they are held in memory, and the slowest robot takes half
an hour for them."""


@dataclass(frozen=True)
class Yardsticks:
    """What the same bodies did from the same starts by agents that infer nothing; None where none can be had."""

    oracle: Episodes | None
    """Told the task."""
    idle: Episodes | None
    """Standing still."""

    @property
    def returns(self) -> dict[str, Float[np.ndarray, " episode"] | None]:
        """Of each, by its name."""
        return {name: None if e is None else np.asarray(e.reward).sum(axis=0) for name, e in vars(self).items()}

    def of(self, trial: Trial) -> Episodes | None:
        """Those of a trial whose agent is one of the two, unless it is to be filmed."""
        return vars(self).get(trial.agent) if trial.on_frame is None else None


@own_jax_settings()
def evaluate(trial: Trial, specs: list[TaskSpec], seeds: int, yardsticks: Yardsticks | None = None) -> Results:
    """Judge an agent on every task, once per evaluation seed 0 to `seeds` - 1, each from a start of its own.

    Yardsticks that were taken before on these tasks and seeds save time.
    RebodyError where module, policies, tasks and robot do not fit together, or there is too much to do at once.
    """
    yardsticks = yardsticks or take_yardsticks(trial, specs, seeds)
    trial = narrowed(trial, specs)
    check_trial(trial, specs)
    specs, episode_seeds, tasks = _episodes_of(trial, specs, seeds)
    agent = trial_agent(trial, tasks)
    frozen = frozen_hashes(trial.inference)
    episodes = yardsticks.of(trial) or run_trial(trial, agent, tasks, start_seeds(specs, episode_seeds))
    assert frozen_hashes(trial.inference) == frozen, "what is frozen has changed"
    read, clusters = agent.reader(episodes.belief), _clusters(trial, episodes)
    return Results(
        robot=trial.robot_name,
        agent=trial.agent,
        inference=trial.module_name,
        tracker=trial.tracker.name if trial.tracker else None,
        control_dt=trial.robot.control_dt if trial.robot else DECISION_DT,
        stride="predicted" if trial.step_predictor else trial.stride,
        horizon=trial.horizon,
        thesis=trial.thesis,
        frozen=frozen,
        sharpened=trial.sharpens,
        family_set=trial.in_play,
        law=trial.payment,
        episodes=episode_results(
            trial.in_play, specs, episode_seeds, tasks, episodes, read, clusters, yardsticks.returns
        ),
    )


@own_jax_settings()
def take_yardsticks(trial: Trial, specs: list[TaskSpec], seeds: int) -> Yardsticks:
    """Oracle and idle in place of a trial's agent: none for a robot without a tracker, and no oracle where that has no
    slot for a task. RebodyError as `evaluate`.
    """
    trial = narrowed(trial, specs)
    check_trial(trial, specs)
    _check_size(trial, len(specs) * seeds)
    if trial.robot is not None and trial.tracker is None:
        return Yardsticks(None, None)
    specs, episode_seeds, tasks = _episodes_of(trial, specs, seeds)
    stride, starts = 1 if trial.thesis else trial.stride, start_seeds(specs, episode_seeds)

    def run(agent: str) -> Episodes:
        other = replace(trial, agent=agent, thesis=False, stride=stride, on_frame=None)
        return run_trial(other, trial_agent(other, tasks), tasks, starts)

    return Yardsticks(None if without_slot(trial, specs) else run("oracle"), run("idle"))


def narrowed(trial: Trial, specs: list[TaskSpec]) -> Trial:
    """The trial with the families that it takes, and no others, in play."""
    asked = dict.fromkeys(family for spec in specs for family in spec.families)
    return replace(trial, families=trial.in_play.only(tuple(asked)))


def start_seeds(specs: list[TaskSpec], seeds: Int[np.ndarray, " episode"]) -> list[int]:
    """What the start of each episode is drawn from: its task and its evaluation seed, whatever else is evaluated.

    Were it the evaluation seed alone, all tasks of a seed would share one start, and be one sample of starts.
    """
    texts = [json.dumps([spec.to_json(), int(seed)]) for spec, seed in zip(specs, seeds, strict=True)]
    return [int.from_bytes(hashlib.sha256(text.encode()).digest()[:8]) for text in texts]


def _episodes_of(
    trial: Trial, specs: list[TaskSpec], seeds: int
) -> tuple[list[TaskSpec], Int[np.ndarray, " episode"], Task]:
    """Task and evaluation seed of each episode, and the tasks that are active, [time, episode]."""
    specs = [spec for spec in specs for _ in range(seeds)]
    episode_seeds = np.tile(np.arange(seeds), len(specs) // seeds)
    return specs, episode_seeds, active_tasks(specs, trial.in_play, trial.decisions, DECISION_DT)


def frozen_hashes(inference: Inference) -> dict[str, str]:
    """SHA-256 of all that a transfer may not change."""
    return {
        "module": tree_hash(inference.parts.module),
        "policy": tree_hash(inference.parts.high_level or inference.parts.told_policy),
    }


def trial_agent(trial: Trial, tasks: Task) -> Agent:
    """The agent of a trial; `tasks` are the active ones, [time, episode], which `oracle` is told."""
    stride = 1 if trial.thesis else trial.stride
    slots = None
    if trial.agent == "reuse" and trial.robot is not None:
        slots = slot_chooser(trial.inference, trial.slots, trial.slots_by)
    return build_agent(
        trial.agent,
        trial.inference,
        tasks,
        families=trial.in_play,
        slots=slots,
        high_level=trial.high_level.policy if trial.high_level else None,
        scratch=trial.scratch.parts if trial.scratch else None,
        stride=stride,
        horizon=trial.horizon,
        sharpen=trial.sharpens,
    )


def run_trial(trial: Trial, agent: Agent, tasks: Task, starts: Starts) -> Episodes:
    """Episodes as arrays, 0.1 s apart; `tasks` are the active ones, [time, episode], `starts` seeds of the resets."""
    families, payday = trial.in_play, first_payday(trial.payment, starts)
    if trial.robot is None:
        episodes = rollout_on_toy(agent, trial.toy or trial.inference.toy, tasks, families, payday=payday)
    else:
        clock, controller = _clock(trial), trial_controller(trial)
        make = ExactWalkers if trial.goes_exactly else simulate
        episodes = rollout_on_robot(
            agent, controller, trial.robot, tasks, families, starts, trial.on_frame, clock, make, payday
        )
    return jax.tree.map(np.asarray, episodes)


def _clusters(trial: Trial, episodes: Episodes) -> Int[np.ndarray, "time episode"]:
    """The mixture's component of each belief of the module; 0 where there is one Gaussian, or another inferrer."""
    mixture, latent = trial.inference.parts.mixture, episodes.belief.mean
    if mixture is None or trial.agent in ("bayes", "scratch"):
        return np.zeros(latent.shape[:2], int)
    return np.asarray(mixture.component(latent))


def _clock(trial: Trial) -> Clock | None:
    """When the agent decides; None for our mode."""
    if not trial.thesis:
        return None
    if trial.step_predictor is None:
        return EvenClock(trial.stride)
    predictor = trial.step_predictor.predictor
    return PredictedClock(predictor, slots_among(trial.in_play, predictor.families))


def trial_controller(trial: Trial) -> Controller:
    """What moves the joints of a trial's robot."""
    if trial.agent == "flat":
        assert trial.flat is not None
        return FlatController(trial.flat.policy, trial.inference.parts.module.decoder)
    if trial.agent == "scratch":
        assert trial.scratch is not None
        return FlatController(trial.scratch.parts.policy, trial.scratch.parts.module.decoder)
    assert trial.tracker is not None
    assert trial.robot is not None
    return TrackerController(trial.tracker.tracker, trial.in_play, trial.robot.goal_ahead)


def _check_size(trial: Trial, episodes: int) -> None:
    most = MOST_DECISIONS // trial.decisions
    if not 1 <= episodes <= most:
        raise RebodyError(
            f"{episodes:,} episodes of {trial.seconds:g} s cannot be evaluated at once: at most {most:,}, at least 1. "
            "Take fewer seeds, or split the task file."
        )
