"""Every task once per evaluation seed, with the oracle's return beside it."""

from dataclasses import dataclass

import jax
import numpy as np

from rebody.agents.agent import Agent
from rebody.agents.parts import HORIZON, Inference, LoadedTracker, build_agent, check_fit
from rebody.agents.rollout import Episodes, OnFrame, rollout_on_robot, rollout_on_toy
from rebody.bodies import RobotSpec
from rebody.errors import RebodyError
from rebody.evaluation.results import Results, episode_results
from rebody.tasks.task_file import TaskSpec, active_tasks
from rebody.types import DECISION_DT, Task

POINT_MASS = "point-mass"


@dataclass(frozen=True)
class Trial:
    """What is put to the test."""

    agent: str
    inference: Inference
    robot: RobotSpec | None
    """None for the point mass."""
    tracker: LoadedTracker | None
    seconds: float = 20.0
    stride: int = 1
    horizon: int = HORIZON
    on_frame: OnFrame | None = None
    """Called at every control step of a robot, to film it."""

    @property
    def robot_name(self) -> str:
        """Name of the body."""
        return POINT_MASS if self.robot is None else self.robot.name

    @property
    def decisions(self) -> int:
        """Decisions of one episode."""
        return round(self.seconds / DECISION_DT)


def evaluate(trial: Trial, specs: list[TaskSpec], seeds: int) -> Results:
    """Judge an agent on every task, once per evaluation seed 0 to `seeds` - 1.

    RebodyError where module, tracker, tasks and robot do not fit together.
    """
    _check(trial, specs)
    specs = [spec for spec in specs for _ in range(seeds)]
    episode_seeds = np.tile(np.arange(seeds), len(specs) // seeds)
    tasks = active_tasks(specs, trial.decisions, DECISION_DT)
    episodes = _run(trial, trial.agent, tasks, episode_seeds, trial.on_frame)
    oracle = _oracle_returns(trial, tasks, episode_seeds, episodes)
    read = trial.inference.parts.probe(episodes.belief)
    results = episode_results(specs, episode_seeds, tasks, episodes, read, oracle)
    return Results(
        robot=trial.robot_name,
        agent=trial.agent,
        inference=trial.inference.name,
        tracker=trial.tracker.name if trial.tracker else None,
        control_dt=trial.robot.control_dt if trial.robot else DECISION_DT,
        stride=trial.stride,
        horizon=trial.horizon,
        episodes=results,
    )


def _run(trial: Trial, kind: str, tasks: Task, seeds: np.ndarray, on_frame: OnFrame | None = None) -> Episodes:
    agent: Agent = build_agent(kind, trial.inference, tasks, stride=trial.stride, horizon=trial.horizon)
    form = trial.inference.contract.reward
    if trial.robot is None:
        episodes = rollout_on_toy(agent, trial.inference.toy, tasks, form)
    else:
        assert trial.tracker is not None
        episodes = rollout_on_robot(agent, trial.tracker.tracker, trial.robot, tasks, form, seeds, on_frame)
    return jax.tree.map(np.asarray, episodes)


def _oracle_returns(trial: Trial, tasks: Task, seeds: np.ndarray, episodes: Episodes) -> np.ndarray | None:
    """Returns of the same tracker told the true target; a toy has no oracle."""
    if trial.robot is None:
        return None
    oracle = episodes if trial.agent == "oracle" else _run(trial, "oracle", tasks, seeds)
    return np.asarray(oracle.reward).sum(axis=0)


def _check(trial: Trial, specs: list[TaskSpec]) -> None:
    if trial.seconds < 3.0:
        raise RebodyError(f"--seconds {trial.seconds:g} is too short: final errors need the last 2 s of at least 3.")
    known = trial.inference.contract.target_ranges
    for spec in specs:
        if spec.switch is not None and round(spec.switch.at_s / DECISION_DT) >= trial.decisions:
            raise RebodyError(f"a switch at {spec.switch.at_s:g} s is not within an episode of {trial.seconds:g} s.")
        for family in {spec.family, spec.last.family}:
            if family not in known and trial.agent == "reuse":
                raise RebodyError(
                    f"'{trial.inference.name}' was trained on {', '.join(known)} and cannot infer '{family}'. "
                    "Choose tasks or a module that fit (rebody list)."
                )
    if trial.robot is None and trial.agent != "reuse":
        raise RebodyError(f"agent '{trial.agent}' drives a tracker, which a point mass does not have; use reuse.")
    if trial.robot is None or trial.tracker is None:
        return
    if trial.tracker.robot != trial.robot.name:
        raise RebodyError(
            f"tracker '{trial.tracker.name}' was trained on '{trial.tracker.robot}', not on '{trial.robot.name}'."
        )
    check_fit(trial.inference, trial.robot.name, trial.robot.moving_fields)
