"""What is read of a robot's joint positions and velocities: the observation mapping (thesis 5.7) of a root that is
held to the plane of x and z, and of one that floats freely in space.
"""

from abc import ABC, abstractmethod
from typing import ClassVar

import mujoco
import numpy as np
from jaxtyping import Float, Int

from rebody.bodies.attitude import (
    about_z,
    in_heading,
    inverse,
    positive,
    product,
    roll_pitch_yaw,
    up_axis,
    wrap_angle,
)
from rebody.types import ANGLES, DECISION_DT, GLOBAL_FIELDS, POSE_FIELDS, GlobalState, global_state

Floats = Float[np.ndarray, "..."]
Root = Float[np.ndarray, "... root"]
"""The root's own numbers of qpos: all that a global state needs."""
Amount = float | Floats
Pose = Float[np.ndarray, "... 6"]
"""x, y, z [m], roll, pitch, yaw [rad], relative to the rest pose."""

FREE, BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
SLIDE, HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)


class Readout(ABC):
    """Reads a robot; arrays have any leading shape."""

    moving_fields: ClassVar[tuple[str, ...]]
    """Fields of the global state that this root can move."""
    root_body: int
    """Id of the body that the root moves and turns."""
    joint_inputs: int
    """How many numbers the joint state has."""
    addresses: Int[np.ndarray, " root"]
    """Where the root's numbers stand in qpos; x first."""
    ground: Int[np.ndarray, " axis"]
    """Where x, and y where it can move along it, stand in qpos."""
    ground_velocity: Int[np.ndarray, " axis"]
    """Where their velocities stand in qvel."""

    def __init__(self, model: mujoco.MjModel):
        kind, first = model.jnt_type, model.jnt_qposadr
        own, place = kind[model.dof_jntid], np.arange(model.nv) - model.jnt_dofadr[model.dof_jntid]
        # a leg's hinge turns at 10 rad/s where the trunk moves at 1 m/s
        self._velocity_scale = np.where((own == SLIDE) | ((own == FREE) & (place < 3)), 1.0, 0.1)
        self._free, self._free_velocity = first[kind == FREE], model.jnt_dofadr[kind == FREE]
        self._balls = first[kind == BALL]

    def root(self, qpos: Floats) -> Root:
        """A copy of the root's own numbers."""
        return qpos[..., self.addresses]

    @abstractmethod
    def pose(self, root: Root) -> Pose:
        """Where it is."""

    @abstractmethod
    def observe(self, root: Root, before: Root) -> GlobalState:
        """The global state, from where it is and where it was a decision ago."""

    @abstractmethod
    def forward(self, root: Root, before: Root) -> Floats:
        """How far it moved forward [m]."""

    @abstractmethod
    def joint_state(self, qpos: Floats, qvel: Floats) -> Float[np.ndarray, "... joint"]:
        """All but where it is and where it heads: positions, then velocities of like size."""

    @abstractmethod
    def place(self, qpos: Floats, qvel: Floats, x: Amount, y: Amount | None, yaw: Amount | None) -> None:
        """Put it there [m, rad], in place, as it stands and moves; None leaves what is."""


class PlanarReadout(Readout):
    """Of a root with three joints: slides along x and z, and a hinge about y."""

    moving_fields = ("x", "z", "pitch", "vx", "vz", "pitch_rate")

    def __init__(self, model: mujoco.MjModel, rest: Float[np.ndarray, " nq"], joints: tuple[str, str, str]):
        """`joints` are the names of those that carry x, z and pitch."""
        super().__init__(model)
        x, z, pitch = (model.joint(name) for name in joints)
        self.addresses = np.array([int(joint.qposadr[0]) for joint in (x, z, pitch)])
        self.ground, self.ground_velocity = self.addresses[:1], x.dofadr
        self.root_body = int(pitch.bodyid[0])
        self.joint_inputs = model.nq - 1 + model.nv
        self._rest_z = float(rest[self.addresses[1]])  # not zero where the slide has a `ref` (hopper, walker: 1.25)
        self._quaternions = np.concatenate([self._balls, self._free + 3])

    def pose(self, root):
        """y, roll and yaw stay 0."""
        pose = np.zeros((*root.shape[:-1], len(POSE_FIELDS)))
        pose[..., 0], pose[..., 2], pose[..., 4] = root[..., 0], root[..., 1] - self._rest_z, wrap_angle(root[..., 2])
        return pose

    def observe(self, root, before):
        """The pitch rate counts whole turns, since the hinge does."""
        x, z, pitch = (root[..., i].astype(np.float32) for i in range(3))
        step = (root - before) / DECISION_DT
        vx, vz, pitch_rate = (step[..., i].astype(np.float32) for i in range(3))
        above_rest = np.asarray(z - np.float32(self._rest_z))
        return global_state(x=x, z=above_rest, pitch=wrap_angle(pitch), vx=vx, vz=vz, pitch_rate=pitch_rate)

    def forward(self, root, before):
        """Along x."""
        return np.asarray(root[..., 0] - before[..., 0])

    def joint_state(self, qpos, qvel):
        """Positions without x, pitch wrapped; bodies that float freely beside the robot are at their x ahead of it."""
        x, _, pitch = self.addresses
        positions = qpos.copy()
        positions[..., self._free] -= qpos[..., [x]]
        for first in self._quaternions:
            positions[..., first : first + 4] = positive(qpos[..., first : first + 4])
        positions = positions.astype(np.float32)
        positions[..., pitch] = wrap_angle(positions[..., pitch])
        velocities = (qvel * self._velocity_scale).astype(np.float32)
        return np.concatenate([np.delete(positions, x, axis=-1), velocities], axis=-1)

    def place(self, qpos, qvel, x, y, yaw):
        """It has neither y nor heading, so those are left out."""
        qpos[..., self.addresses[0]] = x


class FreeReadout(Readout):
    """Of a root that floats freely: position and quaternion in qpos; in qvel its velocity in the world, then how it
    turns in its own frame. Forward is the world's x in the rest pose.
    """

    moving_fields = GLOBAL_FIELDS

    def __init__(self, model: mujoco.MjModel, rest: Float[np.ndarray, " nq"], body: str):
        """`body` is the name of the one with the free joint."""
        super().__init__(model)
        self.root_body = model.body(body).id
        joint = model.joint(int(model.body(body).jntadr[0]))
        first, velocity = int(joint.qposadr[0]), int(joint.dofadr[0])
        self.addresses, self._velocity = np.arange(first, first + 7), velocity
        self.ground, self.ground_velocity = self.addresses[:2], np.arange(velocity, velocity + 2)
        self.joint_inputs = model.nq - 3 + model.nv
        self._rest = rest[self.addresses]
        self._others = [int(address) for address in self._free if address != first]

    def pose(self, root):
        """x and y in the world, z above the rest pose."""
        place = root[..., :3] - [0.0, 0.0, self._rest[2]]
        return np.concatenate([place, roll_pitch_yaw(self._attitude(root))], axis=-1)

    def observe(self, root, before):
        """The rates are those of the angles, the short way round."""
        pose = self.pose(root)
        moved = pose - self.pose(before)
        turned = slice(len(POSE_FIELDS) - len(ANGLES), None)
        moved[..., turned] = wrap_angle(moved[..., turned])
        numbers = np.concatenate([pose, moved / DECISION_DT], axis=-1).astype(np.float32)
        return GlobalState(**{name: numbers[..., i] for i, name in enumerate(GLOBAL_FIELDS)})

    def forward(self, root, before):
        """Along the heading that it had."""
        moved = root[..., :2] - before[..., :2]
        return np.asarray(in_heading(moved, self._yaw(before))[..., 0])

    def joint_state(self, qpos, qvel):
        """z above the rest pose, up in the body's frame, all joints; then velocities: the root's in the heading's
        frame, its turning in the body's. Bodies that float freely beside the robot are seen from where it is and heads.
        """
        root = self.root(qpos)
        yaw, attitude = self._yaw(root), self._attitude(root)
        positions, velocities = qpos.copy(), qvel.copy()
        for first in self._others:
            ahead = in_heading(qpos[..., first : first + 2] - root[..., :2], yaw)
            positions[..., first : first + 2] = ahead
            positions[..., first + 3 : first + 7] = product(about_z(-yaw), qpos[..., first + 3 : first + 7])
        for first in (*self._balls, *(other + 3 for other in self._others)):
            positions[..., first : first + 4] = positive(positions[..., first : first + 4])
        for first in self._free_velocity:
            velocities[..., first : first + 2] = in_heading(qvel[..., first : first + 2], yaw)
        self._turn_to_rest(velocities)
        stance = np.concatenate([root[..., 2:3] - self._rest[2], up_axis(attitude)], axis=-1)
        joints = np.delete(positions, self.addresses, axis=-1)
        seen = np.concatenate([stance, joints, velocities * self._velocity_scale], axis=-1)
        return seen.astype(np.float32)

    def place(self, qpos, qvel, x, y, yaw):
        """Turned, it moves on in the same direction as seen from itself."""
        first, velocity = self.addresses[0], self._velocity
        qpos[..., first] = x
        if y is not None:
            qpos[..., first + 1] = y
        if yaw is not None:
            root = self.root(qpos)
            by = yaw - self._yaw(root)
            qpos[..., first + 3 : first + 7] = product(about_z(by), root[..., 3:])
            qvel[..., velocity : velocity + 2] = in_heading(qvel[..., velocity : velocity + 2], -by)

    def _attitude(self, root: Root) -> Float[np.ndarray, "... 4"]:
        """Relative to the rest pose."""
        return product(root[..., 3:], inverse(self._rest[3:]))

    def _yaw(self, root: Root) -> Floats:
        return roll_pitch_yaw(self._attitude(root))[..., 2]

    def _turn_to_rest(self, velocities: Floats) -> None:
        """How the root turns, in the frame that lies along the world's axes in the rest pose, in place."""
        turning = slice(self._velocity + 3, self._velocity + 6)
        spin = np.concatenate([np.zeros_like(velocities[..., :1]), velocities[..., turning]], axis=-1)
        velocities[..., turning] = product(product(self._rest[3:], spin), inverse(self._rest[3:]))[..., 1:]
