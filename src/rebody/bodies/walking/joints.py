"""What a walking policy hears of a robot, and where it moves joints: all but its network."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float, Int

from rebody.bodies.attitude import inverse, product
from rebody.bodies.walking.servos import is_servo, serve
from rebody.bodies.walking.settings import MJLAB, Term, Walking
from rebody.errors import RebodyError, did_you_mean

NO_COMMAND = 0.01
"""Commands shorter than this are none [m/s, rad/s]."""


@dataclass
class Gait:
    """What a policy remembers of each robot from one control step to the next."""

    last_action: Float[np.ndarray, "robot joint"]
    phase: Float[np.ndarray, "robot leg"]  # rad
    heard: Float[np.ndarray, "robot step number"]  # the newest last
    memory: dict[str, Float[np.ndarray, "robot ..."]]

    def parts(self) -> list[np.ndarray]:
        """All its arrays, in a fixed order."""
        return [self.last_action, self.phase, self.heard, *self.memory.values()]


class JointInterface:
    """For many robots at once; RebodyError where description and model do not fit together."""

    def __init__(
        self,
        robot: str,
        walking: Walking,
        model: mujoco.MjModel,
        rest: Float[np.ndarray, " nq"],
        root: int,
        said: Mapping[str, str],
    ):
        """`rest` are the joint positions of the rest pose, `root` the id of the body that floats freely; `said` is what
        a policy's file says where the description is silent.
        """
        self._robot, self._walking = robot, walking
        self._root = int(model.jnt_qposadr[model.body_jntadr[root]]), int(model.jnt_dofadr[model.body_jntadr[root]])
        self._imu = self._frame(model, root)
        self.inputs = walking.inputs or self._named(_listed(said.get("observation_names")))
        self.actuators: Int[np.ndarray, " joint"] = self._actuators(
            model, walking.joints or _listed(said.get("joint_names"))
        )
        joints = model.actuator_trnid[self.actuators, 0]
        self.names = tuple(model.joint(i).name for i in joints)
        self._at, self.moves = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._unheard = [self.names.index(name) for name in self._known(self.names, walking.unheard)]
        default = _numbers(said.get("default_joint_pos"))
        self.rest = rest[self._at] if default is None or len(default) != len(joints) else default
        scale = walking.action_scale if walking.action_scale is not None else _numbers(said.get("action_scale"))
        self.scale = np.ones(len(joints)) if scale is None else np.broadcast_to(np.asarray(scale), len(joints))
        gains = ((walking.stiffness, "joint_stiffness"), (walking.damping, "joint_damping"))
        self.gains = [np.asarray(own or (_numbers(said.get(key)) if key in said else [])) for own, key in gains]
        self._check()

    def drive(self, model: mujoco.MjModel) -> None:
        """Give the model's actuators these gains, where there are any, in place: its motors become servos."""
        if not all(len(gains) for gains in self.gains):
            return
        for row, p, d in zip(self.actuators, *self.gains, strict=True):
            serve(model, int(row), p, d)

    def gains_in(self, model: mujoco.MjModel) -> tuple[list[float], list[float]]:
        """Stiffness [N m/rad] and damping [N m s/rad] of each joint's servo in a model; none where one has another
        actuator.
        """
        rows = self.actuators
        if not all(is_servo(model, int(row)) for row in rows):
            return [], []
        return (-model.actuator_biasprm[rows, 1]).tolist(), (-model.actuator_biasprm[rows, 2]).tolist()

    def begin(self, robots: int) -> Gait:
        """Robots that have just been reset."""
        phase = self._walking.phase
        offsets = np.zeros(0) if phase is None else np.asarray(phase.offsets)
        return Gait(
            np.zeros((robots, len(self._at)), np.float32),
            np.tile(offsets, (robots, 1)),
            np.zeros((robots, self._walking.history, sum(map(self.size, self.inputs)))),
            {},
        )

    def hear(
        self,
        gait: Gait,
        qpos: Float[np.ndarray, "robot nq"],
        qvel: Float[np.ndarray, "robot nv"],
        command: Float[np.ndarray, "robot 3"],
    ) -> Float[np.ndarray, "robot number"]:
        """What a policy is shown before a control step; the gait remembers it, in place."""
        now = np.concatenate(self._heard(gait, qpos, qvel, command), axis=-1)
        gait.heard = np.concatenate([gait.heard[:, 1:], now[:, None]], axis=1)
        seen = self._stacked(gait.heard).astype(np.float32)
        return seen if self._walking.clip is None else np.clip(seen, -self._walking.clip, self._walking.clip)

    def move(self, gait: Gait, action: Float[np.ndarray, "robot joint"], dt: float) -> Float[np.ndarray, "robot joint"]:
        """Where the joints are to be [rad] during a control step of `dt` seconds; the gait moves on, in place."""
        if self._walking.action_clip is not None:
            action = np.clip(action, -self._walking.action_clip, self._walking.action_clip)
        gait.last_action = action
        if self._walking.phase is not None:
            turned = gait.phase + 2 * np.pi * self._walking.phase.frequency * dt
            gait.phase = np.fmod(turned + np.pi, 2 * np.pi) - np.pi
        return self.rest + self.scale * action

    @property
    def observations(self) -> int:
        """Numbers that a policy is shown."""
        return self._walking.history * sum(map(self.size, self.inputs))

    def _heard(self, gait: Gait, qpos, qvel, command) -> list[Float[np.ndarray, "robot _"]]:
        positions, velocities = qpos[:, self._at] - self.rest, qvel[:, self.moves].copy()
        positions[:, self._unheard] = velocities[:, self._unheard] = 0.0
        linear, angular, gravity = self._felt(qpos, qvel)
        terms = {
            "linear_velocity": linear,
            "angular_velocity": angular,
            "gravity": gravity,
            "command": command,
            "joint_positions": positions,
            "joint_velocities": velocities,
            "last_action": gait.last_action,
            "phase": self._clock(gait.phase, command),
            "height": qpos[:, [self._root[0] + 2]],
        }
        scales = dict(self._walking.scales)
        return [scales.get(name, 1.0) * terms[name] for name in self.inputs]

    def _felt(self, qpos, qvel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By the IMU, in its own frame: its velocity, how it turns, and which way is down."""
        at, moves = self._root
        attitude, turning = qpos[:, at + 3 : at + 7], qvel[:, moves + 3 : moves + 6]  # in the body's frame
        where, turn = self._imu
        linear = _turned(inverse(attitude), qvel[:, moves : moves + 3]) + np.cross(turning, where)
        down = _turned(inverse(attitude), np.broadcast_to([0.0, 0.0, -1.0], linear.shape))
        return _turned(inverse(turn), linear), _turned(inverse(turn), turning), _turned(inverse(turn), down)

    def _clock(self, phase, command):
        settings = self._walking.phase
        if settings is not None and settings.at_rest is not None:
            is_none = np.linalg.norm(command, axis=-1, keepdims=True) < NO_COMMAND
            phase = np.where(is_none, settings.at_rest, phase)
        return np.concatenate([np.cos(phase), np.sin(phase)], axis=-1)

    def _stacked(self, heard: Float[np.ndarray, "robot step number"]) -> Float[np.ndarray, "robot seen"]:
        """Term by term, each the oldest first."""
        if self._walking.history == 1:
            return heard[:, 0]
        ends = np.cumsum([self.size(name) for name in self.inputs])[:-1]
        return np.concatenate([part.reshape(len(heard), -1) for part in np.split(heard, ends, axis=-1)], axis=-1)

    def size(self, name: Term) -> int:
        """Numbers of an input."""
        joints, legs = len(self._at), 0 if self._walking.phase is None else len(self._walking.phase.offsets)
        of_joints = dict.fromkeys(("joint_positions", "joint_velocities", "last_action"), joints)
        return ({"phase": 2 * legs, "height": 1} | of_joints).get(name, 3)

    def _check(self) -> None:
        if "phase" in self.inputs and self._walking.phase is None:
            raise self._misfit("it hears a phase: say [policy.phase] frequency")
        if any(len(gains) not in (0, len(self.names)) for gains in self.gains):
            raise self._misfit(f"stiffness and damping must be {len(self.names)} numbers each, one for each joint")

    def _frame(self, model: mujoco.MjModel, root: int) -> tuple[np.ndarray, np.ndarray]:
        """Place [m] and attitude of the IMU in the root body's frame."""
        if self._walking.imu is None:
            return np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])
        sites = {model.site(i).name: i for i in range(model.nsite)}
        if self._walking.imu not in sites:
            near = did_you_mean(self._walking.imu, sites)
            raise self._misfit(f"the model has no site '{self._walking.imu}' for its IMU{near or '.'}".rstrip("."))
        site = sites[self._walking.imu]
        if model.site_bodyid[site] != root:
            raise self._misfit(f"site '{self._walking.imu}' is not on the body that floats freely")
        return model.site_pos[site].copy(), model.site_quat[site].copy()

    def _named(self, names: list[str]) -> tuple[Term, ...]:
        if not names:
            raise self._misfit("[policy] names no inputs, and the file says nothing of its own")
        if unknown := [name for name in names if name not in MJLAB]:
            raise self._misfit(
                f"its file names an input '{unknown[0]}'; say [policy] inputs in the description's words"
            )
        return tuple(MJLAB[name] for name in names)

    def _actuators(self, model: mujoco.MjModel, joints: Any) -> Int[np.ndarray, " joint"]:
        """Of each joint, in the policy's order."""
        moves = {model.joint(int(model.actuator_trnid[i, 0])).name: i for i in range(model.nu)}
        return np.array([moves[name] for name in self._known(moves, joints)]) if joints else np.arange(model.nu)

    def _known(self, names: Any, chosen: Any) -> Any:
        if missing := [name for name in chosen if name not in names]:
            raise self._misfit(f"no actuator moves a joint '{missing[0]}' (those are {', '.join(names)})")
        return chosen

    def _misfit(self, why: str) -> RebodyError:
        return misfit(self._robot, self._walking, why)


def misfit(robot: str, walking: Walking, why: str) -> RebodyError:
    """What to say where a robot's policy is not for it."""
    policy = walking.artifact if walking.onnx is None else walking.onnx
    return RebodyError(f"robot '{robot}': its walking policy '{policy}' does not fit: {why}.")


def _turned(attitude: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Vectors turned by attitudes."""
    attitude = np.broadcast_to(attitude, (*vector.shape[:-1], 4))
    pure = np.concatenate([np.zeros_like(vector[..., :1]), vector], axis=-1)
    return product(product(attitude, pure), inverse(attitude))[..., 1:]


def _listed(said: str | None) -> list[str]:
    """A list of names as metadata have it: JSON or with commas."""
    if not said:
        return []
    try:
        names = json.loads(said)
    except ValueError:
        names = said.split(",")
    return [str(name).strip() for name in names] if isinstance(names, list) else []


def _numbers(said: str | None) -> Float[np.ndarray, " number"] | None:
    try:
        return np.array([float(number) for number in _listed(said)]) if said else None
    except ValueError:
        return None
