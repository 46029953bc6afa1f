"""Humanoid: go in a direction."""

from typing import ClassVar

import numpy as np
from gymnasium.envs.mujoco.humanoid_v5 import HumanoidEnv, mass_center

from rebody.standard.draws import angles
from rebody.standard.hidden import HiddenTask


class HumanoidDirEnv(HiddenTask, HumanoidEnv):
    """humanoid-dir of PEARL: 0.25 d . dp / timestep - 0.1 sum u^2 - contact + 5; the task is the angle of d.

    dp is what the centre of mass moved by in a step, of five time steps. The contact cost is 5e-7 times the sum of
    squares of the contact forces, at most 10. An episode ends where the root is lower than 1 m or higher than 2 m.
    """

    tasks = angles()
    weights: ClassVar = {"ctrl_cost_weight": 0.1}

    def step(self, action):
        """As Gymnasium's, which tells the reward nothing of the velocity along y."""
        self._before = mass_center(self.model, self.data)
        return super().step(action)

    def reward_parts(self, x_velocity, action):
        """How far it came in that direction, both costs, and 5 for being alive."""
        moved = mass_center(self.model, self.data) - self._before
        towards = np.dot(moved, (np.cos(self.task), np.sin(self.task)))
        return {
            "task": 0.25 * towards / self.model.opt.timestep,
            "ctrl": -self.control_cost(action),
            "contact": -self.contact_cost,
            "survive": 5.0,
        }

    def _get_obs(self):
        # with the world's rows, as Humanoid-v4's
        forces = (self.data.cinert, self.data.cvel, self.data.qfrc_actuator, self.data.cfrc_ext)
        return np.concatenate([self.data.qpos[2:], self.data.qvel, *(each.ravel() for each in forces)])
