"""How closely a tracker follows what the toy does: subgoals recorded on the toy, played to the robot.

    .venv/bin/python benchmarks/toy_subgoals.py

For each horizon H the shipped `position` module solves hidden goals on the toy, and its subgoals are recorded.
The robot then gets the record, a subgoal every 0.1 s, whatever it does itself. The lag is the shift in time
that brings its path closest to the toy's; the error is what is left after that shift.
"""

import numpy as np

from rebody.agents.controller import TrackerController
from rebody.agents.parts import load_inference, load_tracker
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch, load_robot
from rebody.evaluation import evaluate
from rebody.evaluation.trial import Trial
from rebody.tasks import SHIPPED
from rebody.tasks.task_file import TaskSpec
from rebody.types import Subgoal

GOALS = np.linspace(-9.5, 9.5, 20)
HORIZONS = (1, 5, 15)
LAGS_S = np.arange(0.0, 1.55, 0.05)


def main() -> None:
    inference, spec = load_inference("position"), load_robot("cheetah")
    controller = TrackerController(load_tracker("tracker-cheetah").tracker)
    print("| horizon [decisions] | lag [s] | mean error after that shift [m] | final error [m], median |")
    print("|---|---|---|---|")
    for horizon in HORIZONS:
        trial = Trial("reuse", inference, SHIPPED, None, None, horizon=horizon)
        episodes = evaluate(trial, [TaskSpec("goal", (float(goal),)) for goal in GOALS], 1).episodes
        toy = np.array([episode.quantities["x"] for episode in episodes]).T
        robot = play(np.array([episode.subgoal for episode in episodes])[..., 0].T, spec, controller)
        errors = [shifted_error(toy, robot, lag, spec.control_dt) for lag in LAGS_S]
        best = int(np.argmin(errors))
        final = np.median(np.abs(robot[-40:].mean(0) - toy[-1]))
        print(f"| {horizon} | {LAGS_S[best]:.2f} | {errors[best]:.3f} | {final:.3f} |")


def play(subgoals: np.ndarray, spec, controller) -> np.ndarray:
    """x [m] of robots after each control step, given goals [decision, robot]."""
    batch = RobotBatch(spec, subgoals.shape[1])
    batch.reset(np.random.default_rng(0))
    positions = []
    for values in subgoals.astype(np.float32):
        subgoal = Subgoal(np.zeros(len(values), np.int32), values[:, None])
        for _ in range(spec.steps_per_decision):
            follow(controller, batch, subgoal)
            positions.append(batch.x)
    return np.array(positions)


def shifted_error(toy: np.ndarray, robot: np.ndarray, lag: float, control_dt: float) -> float:
    """Mean |robot(t + lag) - toy(t)| [m] over the first 10 s."""
    times = np.arange(1, 101) * 0.1
    steps = np.clip(np.round((times + lag) / control_dt).astype(int) - 1, 0, len(robot) - 1)
    return float(np.abs(robot[steps] - toy[: len(times)]).mean())


if __name__ == "__main__":
    main()
