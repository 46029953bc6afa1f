"""A walking policy on one robot's model: its network between what it hears and where it moves joints."""

from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float

from rebody.bodies.walking.joints import Gait, JointInterface, misfit
from rebody.bodies.walking.onnx_file import OnnxPolicy
from rebody.bodies.walking.settings import Walking
from rebody.bodies.walking.trained import TrainedPolicy
from rebody.errors import RebodyError


class WalkingPolicy:
    """One control step for many robots; RebodyError where policy, description and model do not fit together."""

    def __init__(self, robot: str, walking: Walking, model: mujoco.MjModel, rest: Float[np.ndarray, " nq"], root: int):
        """`rest` are the joint positions of the rest pose, `root` the id of the body that floats freely."""
        self._network = _network(robot, walking)
        self.joints = JointInterface(robot, _spoken_for(walking), model, rest, root, self._network.metadata)
        self._check(robot, walking)

    def begin(self, robots: int) -> Gait:
        """Robots that have just been reset."""
        gait = self.joints.begin(robots)
        gait.memory = self._network.initial(robots)
        return gait

    def step(
        self,
        gait: Gait,
        qpos: Float[np.ndarray, "robot nq"],
        qvel: Float[np.ndarray, "robot nv"],
        command: Float[np.ndarray, "robot 3"],
        dt: float,
    ) -> Float[np.ndarray, "robot joint"]:
        """Where the joints are to be [rad], for a joystick command [m/s, rad/s]; the gait moves on, in place."""
        action, gait.memory = self._network(self.joints.hear(gait, qpos, qvel, command), gait.memory)
        return self.joints.move(gait, action, dt)

    def _check(self, robot: str, walking: Walking) -> None:
        joints, network = self.joints, self._network
        if network.observations != joints.observations:
            said = f"the description says {joints.observations} ({joints.hears})"
            raise misfit(robot, walking, f"it hears {network.observations} numbers, {said}")
        if network.actions != len(joints.names):
            raise misfit(robot, walking, f"it gives {network.actions} numbers for {len(joints.names)} joints")


def has_policy(walking: Walking) -> bool:
    """Whether there is one by now."""
    return walking.onnx is not None or (walking.artifact is not None and TrainedPolicy(walking.artifact).is_there)


def _network(robot: str, walking: Walking) -> OnnxPolicy | TrainedPolicy:
    """RebodyError for a robot that has none yet."""
    if walking.onnx is not None:
        return OnnxPolicy(walking.onnx)
    if walking.artifact is not None:
        return TrainedPolicy(walking.artifact)
    raise RebodyError(
        f"robot '{robot}' has no walking policy yet: `rebody train tracker` learns one, which its [policy] then names "
        'by artifact = "FOLDER".'
    )


def _spoken_for(walking: Walking) -> Walking:
    """What was learned here says by itself what it hears and moves: the description may be of another run by now."""
    if walking.artifact is None:
        return walking
    return replace(walking, inputs=(), joints=(), action_scale=None, stiffness=(), damping=(), scales=(), history=1)
