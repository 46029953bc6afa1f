"""Robots that walk by a policy of their own: a body whose action is the joystick."""

import numpy as np
from jaxtyping import Float

from rebody.bodies.batch import RobotBatch
from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.joystick import WAYS, navigator_sees
from rebody.bodies.walking.policy import Gait, WalkingPolicy


class WalkingBatch(RobotBatch):
    """Many copies of one. An action is forward, sideways and turn, each in [-1, 1] of what the robot can; a step is a
    control step of its policy.
    """

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        assert spec.walking is not None
        self._policy = WalkingPolicy(spec.name, spec.walking, spec.model, spec.rest_qpos, spec.root_body)
        self._policy.drive(spec.model)
        super().__init__(spec, size, threads)
        self.actions, self._joystick = len(WAYS), spec.walking.joystick
        self._gait: Gait = self._policy.begin(size)
        self._stick = np.zeros((size, self.actions))

    def reset(self, rng, who=None):
        """As any robot; the policy forgets, and the stick is let go."""
        super().reset(rng, who)
        ids, fresh = self._ids(who), self._policy.begin(1)
        self._stick[ids] = 0.0
        for mine, new in zip(self._gait.parts(), fresh.parts(), strict=True):
            mine[ids] = new

    def step(self, actions):
        """The joystick, until the next step; it moves no faster than the robot can take."""
        wanted = np.clip(np.asarray(actions, float), -1.0, 1.0)
        self._stick[:] = self._joystick.towards(self._stick, wanted, self.spec.control_dt)
        self.follow(self._joystick.command(self._stick))

    def follow(self, command: Float[np.ndarray, "robot 3"]) -> None:
        """A control step under joystick commands as they are [m/s, rad/s]."""
        targets = self._policy.step(self._gait, self.qpos, self.qvel, command, self.spec.control_dt)
        self._ctrl[:, self._policy.actuators] = targets
        self._advance()

    def proprioception(self):
        """How it moves over the last 0.1 s in the frame of its heading, and what it can (`Joystick`)."""
        return navigator_sees(self.observe(), self._joystick.measured, np).astype(np.float32)

    @property
    def state(self):
        """That of any robot, the stick, and what the policy remembers."""
        return np.concatenate([super().state, *(part.reshape(self.size, -1) for part in self._parts())], axis=1)

    @state.setter
    def state(self, value):
        parts = self._parts()
        ends = np.cumsum([part[0].size for part in parts])
        own, *rest = np.split(value, value.shape[1] - ends[-1] + np.array([0, *ends[:-1]]), axis=1)
        RobotBatch.state.__set__(self, own)
        for part, saved in zip(parts, rest, strict=True):
            part[:] = saved.reshape(part.shape)

    def _parts(self) -> list[np.ndarray]:
        return [self._stick, *self._gait.parts()]
