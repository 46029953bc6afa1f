"""Robots: a description each, and what it means: how a joint state becomes a global state, and when one has fallen."""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.bodies.control_step import steps_per_decision
from rebody.bodies.model import PLANE_JOINTS, compile_model
from rebody.errors import RebodyError
from rebody.ranges import Box
from rebody.types import DECISION_DT, POSE_FIELDS, GlobalState, global_state

Floats = Float[np.ndarray, "..."]

_FREE, _BALL = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_BALL)
_SLIDE, _HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)


@dataclass(frozen=True)
class Fall:
    """When a robot counts as fallen: too low or too much aslant, for long enough."""

    min_height: float = -math.inf
    """Of the torso above the floor [m]."""
    max_pitch: float = math.inf
    """Either way [rad]."""
    lasts_s: float = 0.0
    """Seconds without a break."""


Reach = tuple[tuple[str, Box], ...]
"""What may be asked of a robot's tracker: families by name, each with a range [m ahead, m/s, rad]."""


@dataclass(frozen=True)
class RobotSpec:
    """A planar robot: its model, its control rate and its observation mapping (thesis 5.7)."""

    name: str
    mjcf: Path
    frame_skip: int
    """Simulation steps of one control step."""
    root: tuple[str, str, str] | str
    """Names of the joints that carry x [m], z [m] and pitch [rad] of the root body, or the name of a root body that
    floats freely: it is held to the plane of x and z then."""
    reset_noise: float
    """Half-width of the uniform noise on positions and std of that on velocities at a reset."""
    fall: Fall
    """When it counts as fallen."""
    reach: Reach
    """What its tracker is trained for."""
    goal_ahead: float = math.inf
    """Farthest that its tracker is shown a goal ahead [m]: one that pulls from far away for long can make a robot that
    walks run until it falls."""
    smoothing_s: float = 0.0
    """Time constant of the pace, the mean speed that a tracker sees and is paid by [s]; 0 for the speed of a step. A
    robot that hops or walks moves unevenly: paid by every step, it does best by going slower than it is told."""
    timestep: float | None = None
    """Seconds of a simulation step; None for what the model says."""
    rest: tuple[tuple[str, float], ...] = ()
    """Joints that rest elsewhere than in the model, and where [m, rad]."""
    moving_fields: tuple[str, ...] = ("x", "z", "pitch", "vx", "vz", "pitch_rate")
    """Fields of the global state that this body can move."""

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled model; RebodyError where MuJoCo cannot use it."""
        return compile_model(self.name, self.mjcf, self.root, self.timestep)

    @cached_property
    def control_dt(self) -> float:
        """Seconds of one control step."""
        return self.frame_skip * self.model.opt.timestep

    @cached_property
    def steps_per_decision(self) -> int:
        """Control steps of one decision; RebodyError where they do not divide it."""
        return steps_per_decision(self.name, self.frame_skip, self.model.opt.timestep)

    @property
    def root_joints(self) -> tuple[str, str, str]:
        """Names of the joints that carry x, z and pitch."""
        return PLANE_JOINTS if isinstance(self.root, str) else self.root

    @cached_property
    def root_addresses(self) -> tuple[int, int, int]:
        """Where x, z and pitch stand in qpos."""
        x, z, pitch = (int(self.model.joint(name).qposadr[0]) for name in self.root_joints)
        return x, z, pitch

    @cached_property
    def x_velocity_address(self) -> int:
        """Where the velocity of x stands in qvel."""
        return int(self.model.joint(self.root_joints[0]).dofadr[0])

    @cached_property
    def root_body(self) -> int:
        """Id of the body that pitch turns."""
        return int(self.model.joint(self.root_joints[2]).bodyid[0])

    @cached_property
    def rest_qpos(self) -> Float[np.ndarray, " nq"]:
        """Joint positions of the rest pose; RebodyError where `rest` names what is no slide or hinge."""
        model, qpos = self.model, self.model.qpos0.copy()
        joints = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] in (_SLIDE, _HINGE)}
        for name, position in self.rest:
            if name not in joints:
                raise RebodyError(
                    f"robot '{self.name}': [rest] names '{name}', which is no slide or hinge of its model; "
                    f"those are {', '.join(filter(None, joints))}."
                )
            qpos[model.jnt_qposadr[joints[name]]] = position
        return qpos

    @cached_property
    def torso_height(self) -> float:
        """Height of the root body above the floor in the rest pose [m]."""
        data = mujoco.MjData(self.model)
        data.qpos[:] = self.rest_qpos
        mujoco.mj_kinematics(self.model, data)
        return float(data.xpos[self.root_body][2])

    def observe(self, qpos: Floats, previous_qpos: Floats) -> GlobalState:
        """Global state from the joint positions of this decision and of the one before."""
        x, z, pitch = (qpos[..., i].astype(np.float32) for i in self.root_addresses)
        step = (qpos - previous_qpos) / DECISION_DT
        vx, vz, pitch_rate = (step[..., i].astype(np.float32) for i in self.root_addresses)
        above_rest = np.asarray(z - np.float32(self._rest_z))
        return global_state(x=x, z=above_rest, pitch=wrap_angle(pitch), vx=vx, vz=vz, pitch_rate=pitch_rate)

    @property
    def joint_inputs(self) -> int:
        """How many numbers the joint state has."""
        return self.model.nq - 1 + self.model.nv

    @property
    def tracker_inputs(self) -> int:
        """How many numbers a tracker sees of the body."""
        return self.joint_inputs + (self.smoothing_s > 0)

    def next_pace(self, pace: Floats, moved: Floats) -> Floats:
        """The pace [m/s] after a control step by `moved` [m]."""
        share = min(1.0, self.control_dt / self.smoothing_s) if self.smoothing_s else 1.0
        return np.asarray(pace + share * (moved / self.control_dt - pace))

    def joint_state(self, qpos: Floats, qvel: Floats) -> Float[np.ndarray, "... joint"]:
        """Positions without x, pitch wrapped, then velocities of like size.

        Bodies that float freely beside the robot stand at their x ahead of it; of the two quaternions of an
        orientation it is the one with a real part that is not negative.
        """
        x, _, pitch = self.root_addresses
        positions = qpos.copy()
        positions[..., self._others_x] -= qpos[..., [x]]
        for first in self._quaternions:
            positions[..., first : first + 4] *= np.where(qpos[..., first, None] < 0, -1.0, 1.0)
        positions = positions.astype(np.float32)
        positions[..., pitch] = wrap_angle(positions[..., pitch])
        velocities = (qvel * self._velocity_scale).astype(np.float32)
        return np.concatenate([np.delete(positions, x, axis=-1), velocities], axis=-1)

    def tracker_state(self, qpos: Floats, qvel: Floats, pace: Floats) -> Float[np.ndarray, "... joint"]:
        """What a tracker sees of the body: the joint state, and the pace where that is more than a step's speed."""
        joints = self.joint_state(qpos, qvel)
        if not self.smoothing_s:
            return joints
        return np.concatenate([joints, np.asarray(pace, np.float32)[..., None]], axis=-1)

    @cached_property
    def _velocity_scale(self) -> Float[np.ndarray, " nv"]:
        # a leg's hinge turns at 10 rad/s where the trunk moves at 1 m/s
        model = self.model
        kind, place = model.jnt_type[model.dof_jntid], np.arange(model.nv) - model.jnt_dofadr[model.dof_jntid]
        is_slide = (kind == _SLIDE) | ((kind == _FREE) & (place < 3))
        return np.where(is_slide, 1.0, 0.1)

    @cached_property
    def _others_x(self) -> Int[np.ndarray, " free"]:
        """Where the x of bodies that float freely stands in qpos."""
        return self.model.jnt_qposadr[self.model.jnt_type == _FREE]

    @cached_property
    def _quaternions(self) -> Int[np.ndarray, " quaternion"]:
        """Where orientations begin in qpos."""
        kind, first = self.model.jnt_type, self.model.jnt_qposadr
        return np.concatenate([first[kind == _BALL], first[kind == _FREE] + 3])

    def pitch(self, qpos: Floats) -> Floats:
        """Pitch of the root body, in (-pi, pi] [rad]."""
        return wrap_angle(qpos[..., self.root_addresses[2]])

    def pose(self, qpos: Floats) -> Float[np.ndarray, "... 6"]:
        """The fields of `POSE_FIELDS` at this moment."""
        x, z, _ = self.root_addresses
        pose = np.zeros((*qpos.shape[:-1], len(POSE_FIELDS)), np.float32)
        pose[..., 0], pose[..., 2], pose[..., 4] = qpos[..., x], qpos[..., z] - self._rest_z, self.pitch(qpos)
        return pose

    def lies(self, qpos: Floats) -> Bool[np.ndarray, "..."]:
        """Whether each robot lies on the ground at this moment."""
        z = qpos[..., self.root_addresses[1]] - self._rest_z
        is_low = self.torso_height + z < self.fall.min_height
        return is_low | (np.abs(self.pitch(qpos)) > self.fall.max_pitch)

    @cached_property
    def _rest_z(self) -> float:
        # not zero where the slide joint has a `ref` (hopper, walker: 1.25)
        return float(self.rest_qpos[self.root_addresses[1]])


def wrap_angle(angle: Floats) -> Floats:
    """An angle in (-pi, pi] [rad]."""
    return np.asarray(-((np.pi - angle) % (2 * np.pi) - np.pi), angle.dtype)
