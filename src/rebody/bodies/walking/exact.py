"""Robots that go exactly as their joystick says: what a navigator would make of a perfect walking policy."""

from dataclasses import replace

import numpy as np

from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.batch import WalkingBatch
from rebody.types import POSE_FIELDS

STILL = (0.0, 0.0, 0.0)


class ExactWalkers(WalkingBatch):
    """Copies of one without physics: no dead band, lag, drift or fall. The robot's own limits hold."""

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        assert spec.walking is not None
        joystick = replace(spec.walking.joystick, dead=STILL, drift=STILL)
        super().__init__(replace(spec, walking=replace(spec.walking, joystick=joystick)), size, threads)

    def follow(self, command):
        """A control step: the root moves, joints stay as they are."""
        self.joint_actions = self.gait.last_action
        before, (ahead, left, turn) = self._root(), self.spec.control_dt * np.asarray(command, float).T
        x, y, yaw = self.pose()[:, [0, 1, POSE_FIELDS.index("yaw")]].T
        cos, sin = np.cos(yaw + turn / 2), np.sin(yaw + turn / 2)
        qpos, qvel = self.qpos.copy(), self.qvel.copy()
        self.spec.readout.place(qpos, qvel, x + cos * ahead - sin * left, y + sin * ahead + cos * left, yaw + turn)
        self.qpos[:], self.qvel[:] = qpos, 0.0
        self._trail[:, :-1], self._trail[:, -1] = self._trail[:, 1:], before
