"""HalfCheetah: run at a speed, or in a direction."""

from typing import ClassVar

import numpy as np
from gymnasium.envs.mujoco.half_cheetah_v5 import HalfCheetahEnv

from rebody.standard.draws import directions, speeds
from rebody.standard.hidden import HiddenTask


class CheetahVelEnv(HiddenTask, HalfCheetahEnv):
    """cheetah-vel of PEARL and VariBAD: -|v - v*| - 0.05 sum a^2; the task is v* in [0, 3] m/s."""

    tasks = speeds()
    weights: ClassVar = {"ctrl_cost_weight": 0.05}

    def reward_parts(self, x_velocity, action):
        """How far off the speed is, and the control cost."""
        return {"task": -abs(x_velocity - self.task), "ctrl": -self.control_cost(action)}

    def _get_obs(self):
        # with the torso's place, as theirs
        return np.concatenate([self.data.qpos[1:], self.data.qvel, self.data.body("torso").xpos])


class CheetahDirEnv(CheetahVelEnv):
    """cheetah-dir of PEARL: d v - 0.05 sum a^2; the task is d, 1 or -1."""

    tasks = directions()

    def reward_parts(self, x_velocity, action):
        """The speed in that direction, and the control cost."""
        return {"task": self.task * x_velocity, "ctrl": -self.control_cost(action)}


class AmagoCheetahVelEnv(CheetahVelEnv):
    """AMAGO's cheetah-vel: that reward, 1,000 steps, and Gymnasium's own observation. Its physics, those of
    HalfCheetah-v4, are those of v5.
    """

    def _get_obs(self):
        return HalfCheetahEnv._get_obs(self)
