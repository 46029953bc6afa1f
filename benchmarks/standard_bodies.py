"""Robots whose physics are Gymnasium environments: they move as the environment does, and hear what it pays."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from jaxtyping import Float

from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.walking.batch import WalkingBatch
from rebody.errors import RebodyError


class InEnvironments(RobotBatch):
    """Robots with joints of their own, each in an environment."""

    def __init__(self, spec: RobotSpec, name: str, size: int):
        """RebodyError where the environment's robot is another, or steps otherwise."""
        self.envs = [gymnasium.make(name, disable_env_checker=True) for _ in range(size)]
        own: Any = self.envs[0].unwrapped
        same = (own.model.nq, own.model.nv, own.model.nu) == (spec.model.nq, spec.model.nv, spec.model.nu)
        if not same or not np.isclose(own.dt, spec.control_dt):
            raise RebodyError(f"robot '{spec.name}' is not that of {name}, or its control steps are others.")
        super().__init__(spec, size, threads=1)
        self.rewards: Float[np.ndarray, " robot"] = np.zeros(size)
        """Of the last control step."""
        self.task_rewards: Float[np.ndarray, " robot"] = np.zeros(size)
        """Their parts that are for the task, without costs."""

    def start(self, tasks: Sequence[Any], seeds: Sequence[int]) -> None:
        """Begin an episode of each task."""
        self.reset(np.random.default_rng(0))  # what is remembered of each robot
        for env, task, seed in zip(self.envs, tasks, seeds, strict=True):
            env.reset(seed=seed, options={"task": task})
        self._read()
        self._forget(np.arange(self.size))

    def _simulate(self):
        told = [env.step(ctrl.copy()) for env, ctrl in zip(self.envs, self._ctrl, strict=True)]
        self.rewards = np.array([reward for _, reward, *_ in told])
        self.task_rewards = np.array([info["reward_task"] for *_, info in told])
        self._read()

    def _read(self) -> None:
        for i, env in enumerate(self.envs):
            data: Any = env.unwrapped.data
            self.qpos[i], self.qvel[i] = data.qpos, data.qvel


class WalkersInEnvironments(InEnvironments, WalkingBatch):
    """Robots that walk by a policy of joint targets: the environment's motors become servos.

    Its control cost is of the torques at the end of a step, each as a share of the largest.
    """

    def __init__(self, spec: RobotSpec, name: str, size: int):
        super().__init__(spec, name, size)
        for env in self.envs:
            own: Any = env.unwrapped
            strength = own.model.actuator_gear[:, 0] * own.model.actuator_ctrlrange[:, 1]
            self.joints.drive(own.model)
            own.control_cost = _cost_of_torques(own, strength)


def in_environments(spec: RobotSpec, name: str, size: int) -> InEnvironments:
    """Robots of a kind in environments of that name."""
    return (InEnvironments if spec.walking is None else WalkersInEnvironments)(spec, name, size)


def _cost_of_torques(env: Any, strength: Float[np.ndarray, " joint"]) -> Any:
    return lambda _: env._ctrl_cost_weight * np.sum(np.square(env.data.actuator_force / strength))
