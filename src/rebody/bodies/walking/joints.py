"""What a walking policy hears of a robot, and where it moves joints: all but its network."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float, Int

from rebody.bodies.attitude import inverse, product
from rebody.bodies.walking.metadata import FileSays
from rebody.bodies.walking.servos import is_servo, serve
from rebody.bodies.walking.settings import Term, Walking
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
        says = FileSays(said, self._misfit)
        self.inputs = walking.inputs or says.inputs
        if not self.inputs:
            raise self._misfit("[policy] names no inputs, and the file says nothing of its own")
        self._scales = dict(walking.scales) if walking.inputs else says.scales | dict(walking.scales)
        self._history = walking.history if walking.inputs else says.history or walking.history
        self.actuators: Int[np.ndarray, " joint"] = self._actuators(model, walking.joints or says.joints)
        joints = model.actuator_trnid[self.actuators, 0]
        self.names = tuple(model.joint(i).name for i in joints)
        self._at, self.moves = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        self._unheard = [self.names.index(name) for name in self._known(self.names, walking.unheard)]
        default, scale = says.of_joints("default_joint_pos", len(joints)), walking.action_scale
        self.rest = rest[self._at] if default is None else default
        scale = says.of_joints("action_scale", len(joints)) if scale is None else scale
        self.scale = np.broadcast_to(1.0 if scale is None else np.asarray(scale), len(joints))
        gains = ((walking.stiffness, "joint_stiffness"), (walking.damping, "joint_damping"))
        self._gains = [np.asarray(own) if own else says.of_joints(key, len(joints)) for own, key in gains]
        self._check()

    def drive(self, model: mujoco.MjModel) -> None:
        """Give the model's actuators these gains, where there are any, in place: its motors become servos."""
        stiffness, damping = self._gains
        if stiffness is None or damping is None:
            return
        for row, p, d in zip(self.actuators.tolist(), stiffness, damping, strict=True):
            serve(model, row, p, d)

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
            np.zeros((robots, self._history, sum(map(self.size, self.inputs)))),
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
        return self._history * sum(map(self.size, self.inputs))

    @property
    def hears(self) -> str:
        """In words, with how many numbers each."""
        terms = ", ".join(f"{name} {self.size(name)}" for name in self.inputs)
        return terms if self._history == 1 else f"{terms}; {self._history} steps of each"

    def _heard(self, gait: Gait, qpos, qvel, command) -> list[Float[np.ndarray, "robot _"]]:
        positions, velocities = qpos[:, self._at] - self.rest, qvel[:, self.moves].copy()
        positions[:, self._unheard] = velocities[:, self._unheard] = 0.0
        linear, angular, gravity = self._felt(qpos, qvel)
        phase = self._clock(gait.phase, command)
        terms = {
            "linear_velocity": linear,
            "angular_velocity": angular,
            "gravity": gravity,
            "command": command,
            "command_linear": command[:, :2],
            "command_turn": command[:, 2:],
            "joint_positions": positions,
            "joint_velocities": velocities,
            "last_action": gait.last_action,
            "phase": np.concatenate([np.cos(phase), np.sin(phase)], axis=-1),
            "phase_cosine": np.cos(phase),
            "phase_sine": np.sin(phase),
            "height": qpos[:, [self._root[0] + 2]],
        }
        return [self._scales.get(name, 1.0) * terms[name] for name in self.inputs]

    def _felt(self, qpos, qvel) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """By the IMU, in its own frame: its velocity, how it turns, and which way is down."""
        at, moves = self._root
        attitude, turning = qpos[:, at + 3 : at + 7], qvel[:, moves + 3 : moves + 6]  # in the body's frame
        where, turn = self._imu
        linear = _turned(inverse(attitude), qvel[:, moves : moves + 3]) + np.cross(turning, where)
        down = _turned(inverse(attitude), np.broadcast_to([0.0, 0.0, -1.0], linear.shape))
        return _turned(inverse(turn), linear), _turned(inverse(turn), turning), _turned(inverse(turn), down)

    def _clock(self, phase, command) -> Float[np.ndarray, "robot leg"]:
        """What the clock shows."""
        settings = self._walking.phase
        if settings is None or settings.at_rest is None:
            return phase
        is_none = np.linalg.norm(command, axis=-1, keepdims=True) < NO_COMMAND
        return np.where(is_none, settings.at_rest, phase)

    def _stacked(self, heard: Float[np.ndarray, "robot step number"]) -> Float[np.ndarray, "robot seen"]:
        """Term by term, each the oldest first."""
        if self._history == 1:
            return heard[:, 0]
        ends = np.cumsum([self.size(name) for name in self.inputs])[:-1]
        return np.concatenate([part.reshape(len(heard), -1) for part in np.split(heard, ends, axis=-1)], axis=-1)

    def size(self, name: Term) -> int:
        """Numbers of an input."""
        joints, legs = len(self._at), 0 if self._walking.phase is None else len(self._walking.phase.offsets)
        of_joints = dict.fromkeys(("joint_positions", "joint_velocities", "last_action"), joints)
        of_parts = {"command_linear": 2, "command_turn": 1, "phase": 2 * legs, "phase_cosine": legs, "phase_sine": legs}
        return ({"height": 1} | of_parts | of_joints).get(name, 3)

    def _check(self) -> None:
        if self._walking.phase is None and any(name.startswith("phase") for name in self.inputs):
            raise self._misfit("it hears a phase: say [policy.phase] frequency")
        for name in self.inputs:
            size, scales = self.size(name), np.size(self._scales.get(name, 1.0))
            if scales not in (1, size):
                raise self._misfit(f"{name} is {size} numbers, and its scale is {scales}")
        if any(gains is not None and len(gains) != len(self.names) for gains in self._gains):
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
