"""Ant: go to a place, or in a direction."""

from typing import ClassVar

import numpy as np
from gymnasium.envs.mujoco.ant_v5 import AntEnv

from rebody.standard.draws import forward_and_backward, places
from rebody.standard.hidden import HiddenTask


class AntGoalEnv(HiddenTask, AntEnv):
    """ant-goal of PEARL and VariBAD: -|x - x*| - |y - y*| - 0.1 sum a^2 - contact; the task is a place within 3 m.

    It never ends early. The contact cost is 0.0005 times the sum of squares of the contact forces, each clipped to 1.
    """

    tasks = places()
    weights: ClassVar = {"ctrl_cost_weight": 0.1, "terminate_when_unhealthy": False}

    def reward_parts(self, x_velocity, action):
        """How far off it is, and both costs."""
        apart = np.abs(self.data.body("torso").xpos[:2] - self.task)
        return {"task": -np.sum(apart), "ctrl": -self.control_cost(action), "contact": -self.contact_cost}

    def _get_obs(self):
        # with its place and all contact forces, as theirs
        return np.concatenate([self.data.qpos, self.data.qvel, self.contact_forces.ravel()])


class AntDirEnv(HiddenTask, AntEnv):
    """ant-dir of PEARL: v . d - 0.5 sum a^2 - contact + 1; the task is the angle of d.

    An episode ends where the torso is lower than 0.2 m or higher than 1 m. The contact cost is that of ant-goal.
    """

    tasks = forward_and_backward()
    weights: ClassVar = {"ctrl_cost_weight": 0.5}

    def step(self, action):
        """As Gymnasium's, which tells the reward nothing of the velocity along y."""
        self._before = self.data.body("torso").xpos[:2].copy()
        return super().step(action)

    def reward_parts(self, x_velocity, action):
        """The speed in that direction, both costs, and 1 for being alive."""
        velocity = (self.data.body("torso").xpos[:2] - self._before) / self.dt
        towards = np.dot(velocity, (np.cos(self.task), np.sin(self.task)))
        return {"task": towards, "ctrl": -self.control_cost(action), "contact": -self.contact_cost, "survive": 1.0}

    def _get_obs(self):
        return np.concatenate([self.data.qpos[2:], self.data.qvel])
