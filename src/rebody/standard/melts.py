"""MELTS' base tasks on HalfCheetah: speeds, places, flips, stands and jumps, which may change in mid-episode."""

from typing import Any

from gymnasium.utils import EzPickle

from rebody.standard.cheetah import CheetahVelEnv
from rebody.standard.draws import base_tasks


class MeltsCheetahEnv(CheetahVelEnv):
    """-|error| / |target| - 0.05 sum a^2; the task is a base task and its target, such as ("goal_forward", 7.5).

    Velocities are those of the moment after a step, as there, not displacements over it.
    """

    tasks = base_tasks()

    def __init__(self, split: str = "any", change_every: int | None = None, **settings: Any):
        """The task changes before every `change_every`-th step of an episode, None for never; the rest as for
        `HiddenTask`.
        """
        super().__init__(split, **settings)
        EzPickle.__init__(self, split, change_every, **settings)
        self._change_every, self._steps = change_every, 0

    def reset(self, *, seed: Any = None, options: Any = None):
        """As `HiddenTask`."""
        told = super().reset(seed=seed, options=options)
        self._steps = 0
        return told

    def step(self, action):
        """As Gymnasium's; first the task changes where it is time."""
        self._steps += 1
        if self._change_every and self._steps % self._change_every == 0:
            self.task = self.draw()
        return super().step(action)

    def reward_parts(self, x_velocity, action):
        """How far off the target it is, beside the target's size, and the control cost."""
        base_task, target = self.task
        kind, (x, _, pitch), (vx, vz, pitch_rate) = base_task.split("_")[0], self.data.qpos[:3], self.data.qvel[:3]
        reached = {"velocity": vx, "goal": x, "flip": pitch_rate, "stand": pitch, "jump": abs(vz)}[kind]
        return {"ctrl": -self.control_cost(action), "task": -abs(reached - target) / abs(target)}
