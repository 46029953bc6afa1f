"""A learner that is not ours, on tasks that nobody tells it: soft actor-critic of stable-baselines3
on a point mass whose observation has the frozen module's belief beside it.

    pip install stable-baselines3        (the extra `sb3`)
    python examples/baselines.py
"""

import gymnasium
import numpy as np
from stable_baselines3 import SAC

from rebody.envs import BeliefObservation
from rebody.ranges import interval
from rebody.tasks import FamilySet
from rebody.tasks.line import GOAL

HIDDEN_GOALS = FamilySet((GOAL.within(interval(-5.0, 5.0), law="plain"),))  # m
STEPS = 4000  # of 0.1 s


def believing_point_mass() -> gymnasium.Env:
    """Where it is, how fast, and what is believed of a hidden goal; it is paid by its distance."""
    env = gymnasium.make("rebody/PointMass-v0", families=HIDDEN_GOALS)
    return BeliefObservation(env, "position", control_dt=0.1)


def train(steps: int = STEPS) -> SAC:
    """An agent after so many steps."""
    model = SAC("MlpPolicy", believing_point_mass(), gamma=0.95, learning_rate=1e-3, seed=0, device="cpu")
    return model.learn(steps)


def final_errors(model: SAC, goals: tuple[float, ...] = (-4.0, -2.0, 1.0, 3.0)) -> list[float]:
    """How far from each hidden goal it is after 20 s [m]."""
    env, errors = believing_point_mass(), []
    for goal in goals:
        observation, info = env.reset(seed=0, options={"family": "goal", "target": goal})
        truncated = False
        while not truncated:
            action, _ = model.predict(observation, deterministic=True)
            observation, _, _, truncated, info = env.step(action)
        errors.append(abs(info["x"] - goal))
    return errors


if __name__ == "__main__":
    for steps in (0, STEPS):
        errors = final_errors(train(steps))
        print(f"after {steps:4} steps: mean distance from hidden goals {np.mean(errors):.2f} m")
