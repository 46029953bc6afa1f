"""Robots: a description each, and what it means: how a joint state becomes a global state, and when one has fallen."""

import math
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.attitude import Floats
from rebody.bodies.attitude import wrap_angle as wrap_angle  # where others look for it
from rebody.bodies.control_step import steps_per_decision
from rebody.bodies.model import PLANE_JOINTS, Compiled, Space, compile_model
from rebody.bodies.readout import HINGE, SLIDE, FreeReadout, PlanarReadout, Readout
from rebody.bodies.source import Source, model_file
from rebody.bodies.walking import Walking
from rebody.bodies.walking.joystick import NAVIGATOR_SEES, WAYS
from rebody.errors import RebodyError
from rebody.ranges import Box
from rebody.types import GlobalState


@dataclass(frozen=True)
class Fall:
    """When a robot counts as fallen: too low, too much aslant or on its side, for long enough."""

    min_height: float = -math.inf
    """Of the torso above the floor [m]."""
    max_pitch: float = math.inf
    """Either way [rad]."""
    min_up: float = -math.inf
    """How much of the root body's up axis points up: 1 upright, 0 on its side, -1 upside down."""
    lasts_s: float = 0.0
    """Seconds without a break."""


Reach = tuple[tuple[str, Box], ...]
"""What may be asked of a robot's tracker: families by name, each with a range [m ahead, m/s, rad]."""


@dataclass(frozen=True)
class RobotSpec:
    """A robot: its model, its control rate and its observation mapping (thesis 5.7)."""

    name: str
    mjcf: Source
    """Where its model is."""
    frame_skip: int
    """Simulation steps of one control step."""
    root: tuple[str, str, str] | str
    """Names of the joints that carry x [m], z [m] and pitch [rad] of the root body, or the name of a root body that
    floats freely, see `space`."""
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
    space: Space = "plane"
    """Whether a root body that floats freely is held to the plane of x and z."""
    keyframe: str | None = None
    """Name of the model's keyframe that it rests in, but for what `rest` says; None for the model's own pose."""
    walking: Walking | None = None
    """The policy that it walks by, where it follows a joystick; None where a tracker moves its joints."""

    @cached_property
    def compiled(self) -> Compiled:
        """The compiled model and what came with it; RebodyError where MuJoCo cannot use it."""
        mjcf = model_file(self.mjcf, self.name)
        return compile_model(self.name, mjcf, self.root, self.space, self.timestep, self.keyframe)

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model; RebodyError where MuJoCo cannot use it."""
        return self.compiled.model

    @cached_property
    def control_dt(self) -> float:
        """Seconds of one control step."""
        return self.frame_skip * self.model.opt.timestep

    @cached_property
    def steps_per_decision(self) -> int:
        """Control steps of one decision; RebodyError where they do not divide it."""
        return steps_per_decision(self.name, self.frame_skip, self.model.opt.timestep)

    @property
    def actions(self) -> int:
        """Numbers in its action: joints, or the joystick's ways."""
        return self.model.nu if self.walking is None else len(WAYS)

    @property
    def floats_freely(self) -> bool:
        """Whether its root moves in space, and not in the plane alone."""
        return self.space == "free"

    @property
    def moving_fields(self) -> tuple[str, ...]:
        """Fields of the global state that this body can move."""
        return FreeReadout.moving_fields if self.floats_freely else PlanarReadout.moving_fields

    @cached_property
    def readout(self) -> Readout:
        """The observation mapping."""
        if isinstance(self.root, str) and self.floats_freely:
            return FreeReadout(self.model, self.rest_qpos, self.root)
        return PlanarReadout(self.model, self.rest_qpos, self.root_joints)

    @property
    def root_joints(self) -> tuple[str, str, str]:
        """Names of the joints that carry x, z and pitch of a root in the plane."""
        return PLANE_JOINTS if isinstance(self.root, str) else self.root

    @property
    def root_addresses(self) -> tuple[int, int, int]:
        """Where x, z and pitch stand in qpos; RebodyError for a root that floats freely."""
        if self.floats_freely:
            raise RebodyError(f"robot '{self.name}' floats freely; this is for robots in the plane: space = \"plane\".")
        x, z, pitch = (int(address) for address in self.readout.addresses)
        return x, z, pitch

    @property
    def x_velocity_address(self) -> int:
        """Where the velocity of x stands in qvel."""
        return int(self.readout.ground_velocity[0])

    @property
    def root_body(self) -> int:
        """Id of the body that the root moves and turns."""
        return self.readout.root_body

    @cached_property
    def rest_qpos(self) -> Float[np.ndarray, " nq"]:
        """Joint positions of the rest pose; RebodyError where `rest` names what is no slide or hinge."""
        model, keyframe = self.model, self.compiled.keyframe
        qpos = model.qpos0.copy() if keyframe is None else keyframe.copy()
        joints = {model.joint(i).name: i for i in range(model.njnt) if model.jnt_type[i] in (SLIDE, HINGE)}
        for name, position in self.rest:
            if name not in joints:
                raise RebodyError(
                    f"robot '{self.name}': [rest] names '{name}', which is no slide or hinge of its model; "
                    f"those are {', '.join(filter(None, joints))}."
                )
            qpos[model.jnt_qposadr[joints[name]]] = position
        mujoco.mj_normalizeQuat(model, qpos)
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
        return self.readout.observe(self.readout.root(qpos), self.readout.root(previous_qpos))

    @property
    def joint_inputs(self) -> int:
        """How many numbers the joint state has."""
        return self.readout.joint_inputs

    @property
    def tracker_inputs(self) -> int:
        """How many numbers a tracker sees of the body."""
        return self.joint_inputs + (self.smoothing_s > 0) if self.walking is None else NAVIGATOR_SEES

    def next_pace(self, pace: Floats, moved: Floats) -> Floats:
        """The pace [m/s] after a control step by `moved` [m]."""
        share = min(1.0, self.control_dt / self.smoothing_s) if self.smoothing_s else 1.0
        return np.asarray(pace + share * (moved / self.control_dt - pace))

    def joint_state(self, qpos: Floats, qvel: Floats) -> Float[np.ndarray, "... joint"]:
        """What its joints do: the same wherever it is and heads."""
        return self.readout.joint_state(qpos, qvel)

    def tracker_state(self, qpos: Floats, qvel: Floats, pace: Floats) -> Float[np.ndarray, "... joint"]:
        """What a tracker sees of the body: the joint state, and the pace where that is more than a step's speed."""
        joints = self.joint_state(qpos, qvel)
        if not self.smoothing_s:
            return joints
        return np.concatenate([joints, np.asarray(pace, np.float32)[..., None]], axis=-1)

    def pose(self, qpos: Floats) -> Float[np.ndarray, "... 6"]:
        """x, y, z [m], roll, pitch and yaw [rad] now, relative to the rest pose."""
        return self.readout.pose(self.readout.root(qpos))

    def pitch(self, qpos: Floats) -> Floats:
        """Pitch of the root body, in (-pi, pi] [rad]."""
        return np.asarray(self.pose(qpos)[..., 4])

    def lies(self, qpos: Floats) -> Bool[np.ndarray, "..."]:
        """Whether each robot lies on the ground at this moment."""
        *_, z, roll, pitch, _ = np.moveaxis(self.pose(qpos), -1, 0)
        is_low = self.torso_height + z < self.fall.min_height
        return is_low | (np.abs(pitch) > self.fall.max_pitch) | (np.cos(roll) * np.cos(pitch) < self.fall.min_up)
