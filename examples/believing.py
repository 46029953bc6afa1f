"""A point mass that nobody tells its goal: an environment with a belief beside its observation, and three lines that
go where the belief says.

    python examples/believing.py
"""

import gymnasium
import numpy as np

from rebody.envs import BeliefObservation


def walk(goal: float, seconds: float = 10.0) -> tuple[float, float]:
    """Where it ends, and where it believes the goal to be [m]."""
    env = BeliefObservation(gymnasium.make("rebody/PointMass-v0"), "position", control_dt=0.1)
    observation, _ = env.reset(options={"family": "goal", "target": goal})
    for _ in range(round(10 * seconds)):
        observation, *_ = env.step(np.clip(env.reading.target - observation[:1], -1.0, 1.0))
    return observation[0], env.reading.target[0]


if __name__ == "__main__":
    for goal in (-8.0, 3.0):
        end, believed = walk(goal)
        print(f"hidden goal {goal:g} m: believed {believed:.2f} m, reached {end:.2f} m")
