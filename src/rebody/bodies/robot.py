"""Robots: a description each, and many of them stepped at once by MuJoCo's own batch engine.

The only file that knows `mujoco.batch`.
"""

import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import mujoco
import mujoco.batch
import numpy as np
from jaxtyping import Bool, Float

from rebody.errors import RebodyError
from rebody.ranges import Finite, Positive
from rebody.types import DECISION_DT, GlobalState

Floats = Float[np.ndarray, "..."]

# MuJoCo counts these and then resets the simulation by itself: its state looks healthy afterwards
_DIVERGED = [
    int(warning)
    for warning in (
        mujoco.mjtWarning.mjWARN_BADQPOS,
        mujoco.mjtWarning.mjWARN_BADQVEL,
        mujoco.mjtWarning.mjWARN_BADQACC,
        mujoco.mjtWarning.mjWARN_BADCTRL,
    )
]


PLANE_JOINTS = ("rebody-x", "rebody-z", "rebody-pitch")
"""Joints of a root body that is held to the plane."""


@dataclass(frozen=True)
class Fall:
    """When a robot counts as fallen: too low or too much aslant, for long enough."""

    min_height: float = -math.inf
    """Of the torso above the floor [m]."""
    max_pitch: float = math.inf
    """Either way [rad]."""
    lasts_s: float = 0.0
    """Seconds without a break."""


@dataclass(frozen=True)
class Reach:
    """What may be asked of a robot's tracker."""

    speed: tuple[Finite, Finite]
    """Fastest backward (negative) and forward [m/s]."""
    distance: Positive = 5.0
    """Farthest goal [m]; farther ones are cut to it."""
    pitch: tuple[Finite, Finite] | None = None
    """Pitches that it can stand at [rad]; None for a robot that is not asked to."""
    jump: tuple[Finite, Finite] | None = None
    """Vertical speeds that it can jump at [m/s]; None for a robot that is not asked to."""

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Smallest and largest value of each slot that it has, by the family's name [m ahead, m/s, rad, m/s]."""
        ends = {
            "goal": (-self.distance, self.distance),
            "velocity": self.speed,
            "stand": self.pitch,
            "jump": self.jump,
        }
        return {name: limits for name, limits in ends.items() if limits is not None}

    def within(self, family: str, low: float, high: float) -> tuple[float, float]:
        """What it reaches of a family's targets from `low` to `high`; goals may lie farther off than `distance`."""
        if family == "goal" or family not in self.limits:
            return low, high
        lowest, highest = self.limits[family]
        return max(low, lowest), min(high, highest)


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
    moving_fields: tuple[str, ...] = ("x", "z", "pitch", "vx", "vz", "pitch_rate")
    """Fields of the global state that this body can move."""

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        try:
            spec = mujoco.MjSpec.from_file(str(self.mjcf))
        except ValueError as error:
            raise RebodyError(f"robot '{self.name}': MuJoCo cannot read '{self.mjcf}': {error}") from error
        if isinstance(self.root, str):
            _hold_to_plane(spec, self.root, self.name)
        with warnings.catch_warnings():
            # what MuJoCo advises instead of the cheetah's `settotalmass` changes the last bits of its physics
            warnings.filterwarnings("ignore", message="compiler attribute 'settotalmass'")
            try:
                return spec.compile()
            except ValueError as error:
                raise RebodyError(f"robot '{self.name}': MuJoCo cannot use '{self.mjcf}': {error}") from error

    @cached_property
    def control_dt(self) -> float:
        """Seconds of one control step."""
        return self.frame_skip * self.model.opt.timestep

    @cached_property
    def steps_per_decision(self) -> int:
        """Control steps of one decision; RebodyError where they do not divide it."""
        steps = round(DECISION_DT / self.control_dt)
        if steps < 1 or abs(steps * self.control_dt - DECISION_DT) > 1e-9:
            raise RebodyError(
                f"robot '{self.name}': a control step of {self.control_dt:g} s does not divide a decision "
                f"of {DECISION_DT} s. Choose a frame_skip so that it does "
                f"(time step {self.model.opt.timestep:g} s)."
            )
        return steps

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
    def torso_height(self) -> float:
        """Height of the root body above the floor in the rest pose [m]."""
        x_joint = self.model.joint(self.root_joints[0])
        return float(self.model.body_pos[self.model.jnt_bodyid[x_joint.id]][2])

    def observe(self, qpos: Floats, previous_qpos: Floats) -> GlobalState:
        """Global state from the joint positions of this decision and of the one before."""
        x, z, pitch = (qpos[..., i].astype(np.float32) for i in self.root_addresses)
        step = (qpos - previous_qpos) / DECISION_DT
        vx, vz, pitch_rate = (step[..., i].astype(np.float32) for i in self.root_addresses)
        still = np.zeros_like(x)
        return GlobalState(
            x=x, y=still, z=np.asarray(z - np.float32(self._rest_z)), pitch=wrap_angle(pitch),
            vx=vx, vy=still, vz=vz, pitch_rate=pitch_rate,
        )  # fmt: skip

    @property
    def tracker_inputs(self) -> int:
        """How many numbers a tracker sees of the body."""
        return self.model.nq - 1 + self.model.nv + (self.smoothing_s > 0)

    def next_pace(self, pace: Floats, moved: Floats) -> Floats:
        """The pace [m/s] after a control step by `moved` [m]."""
        share = min(1.0, self.control_dt / self.smoothing_s) if self.smoothing_s else 1.0
        return np.asarray(pace + share * (moved / self.control_dt - pace))

    def joint_state(self, qpos: Floats, qvel: Floats) -> Float[np.ndarray, "... joint"]:
        """Positions without x, pitch wrapped, then velocities of like size."""
        x, _, pitch = self.root_addresses
        positions = qpos.astype(np.float32)
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
    def _velocity_scale(self) -> Floats:
        # a leg's hinge turns at 10 rad/s where the trunk moves at 1 m/s
        is_slide = self.model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE
        return np.where(is_slide, 1.0, 0.1)

    def pitch(self, qpos: Floats) -> Floats:
        """Pitch of the root body, in (-pi, pi] [rad]."""
        return wrap_angle(qpos[..., self.root_addresses[2]])

    def lies(self, qpos: Floats) -> Bool[np.ndarray, "..."]:
        """Whether each robot lies on the ground at this moment."""
        z = qpos[..., self.root_addresses[1]] - self._rest_z
        is_low = self.torso_height + z < self.fall.min_height
        return is_low | (np.abs(self.pitch(qpos)) > self.fall.max_pitch)

    @cached_property
    def _rest_z(self) -> float:
        # not zero where the slide joint has a `ref` (hopper, walker: 1.25)
        return float(self.model.qpos0[self.root_addresses[1]])


def _hold_to_plane(spec: mujoco.MjSpec, body_name: str, robot: str) -> None:
    """Replace a body's free joint by slides along x and z and a hinge about y."""
    body = spec.body(body_name)
    free = [joint for joint in body.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE] if body else []
    if not free:
        raise RebodyError(f"robot '{robot}': its model has no body '{body_name}' that floats freely (a free joint).")
    spec.delete(free[0])
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = ((slide, [1, 0, 0]), (slide, [0, 0, 1]), (hinge, [0, 1, 0]))
    for name, (kind, axis) in zip(PLANE_JOINTS, axes, strict=True):
        joint = body.add_joint(name=name, type=kind, axis=axis, limited=False, armature=0)
        joint.damping[:], joint.stiffness[:], joint.frictionloss = 0, 0, 0  # whatever the model's defaults say
    for key in list(spec.keys):  # they have a number more than the joints now
        spec.delete(key)


def wrap_angle(angle: Floats) -> Floats:
    """An angle in (-pi, pi] [rad]."""
    return np.asarray(-((np.pi - angle) % (2 * np.pi) - np.pi), angle.dtype)


class RobotBatch:
    """Many copies of one robot, stepped together; bit-identical for any number of threads."""

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        """`threads` = 0 uses every processor."""
        self.spec = spec
        self.size = size
        self._batch = mujoco.batch.Batch(spec.model, size, threads)
        self.qpos: Float[np.ndarray, "robot nq"] = self._batch.bind("qpos")
        self.qvel: Float[np.ndarray, "robot nv"] = self._batch.bind("qvel")
        self._ctrl = self._batch.bind("ctrl")
        self.lying_s: Float[np.ndarray, " robot"] = np.zeros(size)
        """Seconds that each robot has lain on the ground without a break."""
        self.pace: Float[np.ndarray, " robot"] = np.zeros(size)
        """Mean speed of each robot over the last moments [m/s], see `RobotSpec.smoothing_s`."""

    @property
    def x(self) -> Float[np.ndarray, " robot"]:
        """A copy of where each robot is [m]."""
        return self.qpos[:, self.spec.root_addresses[0]].copy()

    @property
    def fallen(self) -> Bool[np.ndarray, " robot"]:
        """Which robots have lain long enough to count as fallen."""
        return (self.lying_s > 0) & (self.lying_s >= self.spec.fall.lasts_s)

    def reset(self, rng: np.random.Generator, robots: Bool[np.ndarray, " robot"] | None = None) -> None:
        """Put the chosen robots (default: all) at x = 0 in the rest pose, with Gymnasium's reset noise."""
        ids = np.arange(self.size) if robots is None else np.flatnonzero(robots)
        if ids.size == 0:
            return
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        model, noise = self.spec.model, self.spec.reset_noise
        qpos = model.qpos0 + rng.uniform(-noise, noise, (ids.size, model.nq))
        qpos[:, self.spec.root_addresses[0]] = 0.0
        self.qpos[ids] = qpos
        self.qvel[ids] = noise * rng.standard_normal((ids.size, model.nv))
        self.lying_s[ids] = 0.0
        self.pace[ids] = 0.0

    def step(self, actions: Float[np.ndarray, "robot nu"]) -> None:
        """One control step with joint actions in [-1, 1]; RebodyError if a simulation diverged."""
        before, (low, high) = self.x, self.spec.model.actuator_ctrlrange.T
        # centre and half-width, so that an action in a range of [-1, 1] arrives without rounding
        self._ctrl[:] = 0.5 * (low + high) + 0.5 * (high - low) * np.clip(actions, -1.0, 1.0)
        self._batch.step(nstep=self.spec.frame_skip)
        if self._batch.warning[:, _DIVERGED, 1].any():
            raise RebodyError(
                f"the simulation of '{self.spec.name}' diverged; check that its actions are finite, "
                "or lower the model's time step."
            )
        self.lying_s[:] = np.where(self.spec.lies(self.qpos), self.lying_s + self.spec.control_dt, 0.0)
        self.pace[:] = self.spec.next_pace(self.pace, self.x - before)

    def push(self, change: Float[np.ndarray, " robot"]) -> None:
        """Change the speed of each robot's every part along x [m/s]."""
        self.qvel[:, self.spec.x_velocity_address] += change

    def joint_state(self) -> Float[np.ndarray, "robot joint"]:
        """Joint state of each robot."""
        return self.spec.joint_state(self.qpos, self.qvel)

    def tracker_state(self) -> Float[np.ndarray, "robot joint"]:
        """What a tracker sees of each robot."""
        return self.spec.tracker_state(self.qpos, self.qvel, self.pace)

    @property
    def state(self) -> Float[np.ndarray, "robot state"]:
        """A copy of all that stepping continues from bit-exactly: mjSTATE_INTEGRATION, `lying_s` and `pace`."""
        return np.column_stack([self._batch.state, self.lying_s, self.pace])

    @state.setter
    def state(self, value: Float[np.ndarray, "robot state"]) -> None:
        self._batch.state[:] = value[:, :-2]
        self.lying_s[:], self.pace[:] = value[:, -2:].T
        self._batch.warning[:] = 0
