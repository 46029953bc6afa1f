"""What figures are drawn from: named arrays."""

from pathlib import Path

import numpy as np
import safetensors.numpy

from rebody.evaluation.evaluate import run_trial, start_seeds, trial_agent
from rebody.evaluation.trial import Trial, check_trial
from rebody.store.files import written_whole
from rebody.tasks.line import GOAL, LINE
from rebody.tasks.task_file import TaskSpec, active_tasks
from rebody.types import DECISION_DT

Data = dict[str, np.ndarray]

LOGS = Path(__file__).parent / "logs"
POINTS = 400
"""Points of a trajectory that are kept, at most."""


def shipped(number: str) -> Data:
    """The log of a figure that lies in the package."""
    return safetensors.numpy.load_file(LOGS / f"{number}.safetensors")


def save(data: Data, path: Path) -> None:
    """Write a log."""
    with written_whole(path) as unfinished:
        safetensors.numpy.save_file({name: np.array(array, order="C") for name, array in data.items()}, unfinished)


def on_goals(trial: Trial, targets: np.ndarray) -> Data:
    """`trajectories` on hidden goals."""
    return trajectories(trial, [TaskSpec(GOAL.name, (float(target),)) for target in targets])


def trajectories(trial: Trial, specs: list[TaskSpec]) -> Data:
    """Episodes on hidden tasks of the line.

    time_s [time]; position_m, velocity_m_s and pitch_rad [time, episode]; latent [time, episode, latent]; family
    (its index on the line) and target [episode]. `decision_s` is the time from one decision to the next.
    """
    check_trial(trial, specs)
    tasks = active_tasks(specs, trial.in_play, trial.decisions, DECISION_DT)
    episodes = run_trial(trial, trial_agent(trial, tasks), tasks, start_seeds(specs, np.zeros(len(specs), int)))
    every = -(-trial.decisions // POINTS)
    kept = np.arange(every - 1, trial.decisions, every)
    decision_s = trial.stride * trial.robot.control_dt if trial.robot and trial.thesis else DECISION_DT
    return {
        "time_s": DECISION_DT * (kept + 1.0),
        "position_m": np.asarray(episodes.state.x)[kept],
        "velocity_m_s": np.asarray(episodes.state.vx)[kept],
        "pitch_rad": np.asarray(episodes.state.pitch)[kept],
        "latent": np.asarray(episodes.belief.mean)[kept],
        "family": np.array([LINE.index(spec.last.family) for spec in specs]),
        "target": np.array([spec.last.target[0] for spec in specs]),
        "decision_s": np.array(decision_s),
    }


def join(parts: dict[str, Data]) -> Data:
    """Several logs as one."""
    return {f"{part}/{name}": array for part, data in parts.items() for name, array in data.items()}


def split(data: Data, part: str) -> Data:
    """One log of several."""
    return {name.removeprefix(f"{part}/"): array for name, array in data.items() if name.startswith(f"{part}/")}
