"""Robots that walk by a policy: bodies whose action is where their joints go, or the joystick."""

from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float

from rebody.bodies.batch import RobotBatch
from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.joints import Gait, JointInterface
from rebody.bodies.walking.joystick import WAYS, navigator_sees
from rebody.bodies.walking.metadata import TERMS
from rebody.bodies.walking.policy import WalkingPolicy
from rebody.errors import RebodyError, did_you_mean


class GaitBatch(RobotBatch):
    """Many copies of a robot whose joints are servos, and what is remembered of each one's gait."""

    def __init__(self, spec: RobotSpec, size: int, threads: int, joints: JointInterface):
        self.joints = joints
        joints.drive(spec.model)
        super().__init__(spec, size, threads)
        self.gait: Gait = self._begin(size)

    def reset(self, rng, who=None):
        """As any robot; its gait is forgotten."""
        super().reset(rng, who)
        ids, fresh = self._ids(who), self._begin(1)
        for mine, new in zip(self.gait.parts(), fresh.parts(), strict=True):
            mine[ids] = new

    @property
    def state(self):
        """That of any robot, and what is remembered of its gait."""
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
        """Arrays of its own, in a fixed order."""
        return self.gait.parts()

    def _begin(self, robots: int) -> Gait:
        return self.joints.begin(robots)

    def _move(self, targets: Float[np.ndarray, "robot joint"]) -> None:
        """A control step with joints on their way to these positions [rad]."""
        self.joint_actions = self.gait.last_action
        self._ctrl[:, self.joints.actuators] = targets
        self._advance()


class JointBatch(GaitBatch):
    """Those that are to learn to walk. An action is where each joint is to be, in [-1, 1] around the rest pose."""

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        """RebodyError for a robot whose description says nothing of a policy."""
        super().__init__(spec, size, threads, joint_interface(spec))
        self.actions = len(self.joints.names)
        self._geoms, self._turned = self._batch.bind("geom_xpos"), self._batch.bind("geom_xmat")
        self._feet = feet_of(spec)
        self._extent, self._round = extents(spec.model, self._feet)

    def step(self, actions):
        """Joint targets, for a control step."""
        action = np.clip(np.asarray(actions, np.float32), -1.0, 1.0)
        self._move(self.joints.move(self.gait, action, self.spec.control_dt))

    @property
    def joint_velocities(self) -> Float[np.ndarray, "robot joint"]:
        """In the order of the actions [rad/s]."""
        return self.qvel[:, self.joints.moves]

    @property
    def feet(self) -> Float[np.ndarray, "robot foot 3"]:
        """A copy of where the lowest points of the feet are, and the centres over the ground [m]."""
        points = self._geoms.reshape(self.size, -1, 3)[:, self._feet]
        upright = np.abs(self._turned.reshape(self.size, -1, 3, 3)[:, self._feet, 2])
        points[..., 2] -= self._round + (upright * self._extent).sum(axis=-1)
        return points

    def hear(self, command: Float[np.ndarray, "robot 3"]) -> Float[np.ndarray, "robot number"]:
        """What a policy would be shown of them under these commands [m/s, rad/s]."""
        return self.joints.hear(self.gait, self.qpos, self.qvel, command)


class WalkingBatch(GaitBatch):
    """Those that walk already. An action is forward, sideways and turn, each in [-1, 1] of what the robot can; a step
    is a control step of its policy.
    """

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        assert spec.walking is not None
        self._policy = WalkingPolicy(spec.name, spec.walking, spec.model, spec.rest_qpos, spec.root_body)
        super().__init__(spec, size, threads, self._policy.joints)
        self.actions, self._joystick = len(WAYS), spec.walking.joystick
        self._stick = np.zeros((size, self.actions))

    def reset(self, rng, who=None):
        """As any robot; the policy forgets, and the stick is let go."""
        super().reset(rng, who)
        self._stick[self._ids(who)] = 0.0

    def step(self, actions):
        """The joystick, until the next step; it moves no faster than the robot can take."""
        wanted = np.clip(np.asarray(actions, float), -1.0, 1.0)
        self._stick[:] = self._joystick.towards(self._stick, wanted, self.spec.control_dt)
        self.follow(self._joystick.command(self._stick))

    def follow(self, command: Float[np.ndarray, "robot 3"]) -> None:
        """A control step under joystick commands as they are [m/s, rad/s]."""
        self._move(self._policy.step(self.gait, self.qpos, self.qvel, command, self.spec.control_dt))

    def proprioception(self):
        """How it moves over the last 0.1 s in the frame of its heading, and what it can (`Joystick`)."""
        return navigator_sees(self.observe(), self._joystick.measured, np).astype(np.float32)

    def _begin(self, robots: int) -> Gait:
        return self._policy.begin(robots)

    def _parts(self) -> list[np.ndarray]:
        """The stick beside the gait."""
        return [self._stick, *super()._parts()]


def feet_of(spec: RobotSpec) -> list[int]:
    """Ids of the geoms that it stands on; RebodyError where the model has none of such a name."""
    named, model = spec.walking.feet if spec.walking else (), spec.model
    geoms = {model.geom(i).name: i for i in range(model.ngeom)}
    if missing := [name for name in named if name not in geoms]:
        near = did_you_mean(missing[0], geoms)
        raise RebodyError(f"robot '{spec.name}': [policy] feet names '{missing[0]}', which is no geom.{near or ''}")
    return [geoms[name] for name in named]


def extents(model: mujoco.MjModel, geoms: list[int]) -> tuple[Float[np.ndarray, "geom 3"], Float[np.ndarray, " geom"]]:
    """How far geoms reach from their centres: along their own axes, and from there in every direction [m]. Of other
    shapes than spheres, capsules and boxes the sphere around them.
    """
    along, around = np.zeros((len(geoms), 3)), model.geom_rbound[geoms].copy()
    for i, (kind, size) in enumerate(zip(model.geom_type[geoms], model.geom_size[geoms], strict=True)):
        if kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
            along[i, 2], around[i] = size[1], size[0]
        elif kind == mujoco.mjtGeom.mjGEOM_BOX:
            along[i], around[i] = size, 0.0
    return along, around


def joint_interface(spec: RobotSpec) -> JointInterface:
    """What a policy that is to be learned hears and moves: that of its description, one control step at a time, as it
    is. RebodyError for a robot whose description says nothing of a policy, or an input that none of ours hears.
    """
    if spec.walking is None:
        raise RebodyError(f"robot '{spec.name}' follows no joystick: its description has no [policy].")
    if unknown := [term for term in spec.walking.inputs if term not in TERMS.values()]:
        raise RebodyError(f"robot '{spec.name}': a policy that is learned here does not hear {unknown[0]}.")
    bare = replace(spec.walking, scales=(), clip=None, action_clip=None, history=1, phase=None, unheard=())
    return JointInterface(spec.name, bare, spec.model, spec.rest_qpos, spec.root_body, {})
