"""Many copies of one robot, stepped at once by MuJoCo's own batch engine: the only file that knows `mujoco.batch`."""

from typing import Any

import mujoco
import mujoco.batch
import numpy as np
from jaxtyping import Float

from rebody.bodies.robot import RobotSpec
from rebody.bodies.simulation import Simulation
from rebody.errors import RebodyError

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


class RobotBatch(Simulation):
    """Many copies of one robot, stepped together; bit-identical for any number of threads. A step is a control step."""

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        """`threads` = 0 uses every processor."""
        self.spec, self.size, self._threads = spec, size, threads
        self.actions, self.root, self.steps_per_decision = spec.model.nu, spec.root_body, spec.steps_per_decision
        self._batch = mujoco.batch.Batch(spec.model, size, threads)
        self.qpos: Float[np.ndarray, "robot nq"] = self._batch.bind("qpos")
        self.qvel: Float[np.ndarray, "robot nv"] = self._batch.bind("qvel")
        self._ctrl = self._batch.bind("ctrl")
        self.lying_s: Float[np.ndarray, " robot"] = np.zeros(size)
        """Seconds that each robot has lain on the ground without a break."""
        self.pace: Float[np.ndarray, " robot"] = np.zeros(size)
        """Mean speed of each robot over the last moments [m/s], see `RobotSpec.smoothing_s`."""
        self._trail = np.repeat(self._root()[:, None], self.steps_per_decision, axis=1)
        """Where each robot's root was before each step of the last decision, the earliest first."""

    def __getstate__(self) -> dict[str, Any]:
        # MuJoCo's batch cannot be copied; the numbers that it continues from can
        return {"made_of": (self.spec, self.size, self._threads), "state": self.state}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(*state["made_of"])
        self.state = state["state"]

    @property
    def model(self):
        """The robot's own model."""
        return self.spec.model

    @property
    def x(self) -> Float[np.ndarray, " robot"]:
        """A copy of where each robot is [m]."""
        return self.qpos[:, self.spec.readout.ground[0]].copy()

    @property
    def fallen(self):
        """Which robots have lain long enough to count as fallen."""
        return (self.lying_s > 0) & (self.lying_s >= self.spec.fall.lasts_s)

    def picture_pose(self):
        """A copy of all joint positions."""
        return self.qpos.copy()

    def reset(self, rng, who=None):
        """With Gymnasium's reset noise."""
        ids = self._ids(who)
        if ids.size == 0:
            return
        self._batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        model, noise = self.spec.model, self.spec.reset_noise
        qpos = self.spec.rest_qpos + rng.uniform(-noise, noise, (ids.size, model.nq))
        for pose in qpos:
            mujoco.mj_normalizeQuat(model, pose)
        qpos[:, self.spec.readout.ground] = 0.0
        self.qpos[ids] = qpos
        self.qvel[ids] = noise * rng.standard_normal((ids.size, model.nv))
        self.lying_s[ids] = 0.0
        self.pace[ids] = 0.0
        self._forget(ids)

    def place(self, x, y=None, yaw=None, who=None):
        """Other bodies of the model stay where they are."""
        ids = self._ids(who)
        qpos, qvel = self.qpos[ids], self.qvel[ids]
        self.spec.readout.place(qpos, qvel, x, y, yaw)
        self.qpos[ids], self.qvel[ids] = qpos, qvel
        self._forget(ids)

    def push(self, change):
        """A robot in the plane is pushed along x alone."""
        along = self.spec.readout.ground_velocity
        change = change.reshape(self.size, -1)[:, : len(along)]
        self.qvel[:, along[: change.shape[1]]] += change

    def step(self, actions):
        """RebodyError if a simulation diverged."""
        low, high = self.spec.model.actuator_ctrlrange.T
        # centre and half-width, so that an action in a range of [-1, 1] arrives without rounding
        self.joint_actions = np.clip(actions, -1.0, 1.0)
        self._ctrl[:] = 0.5 * (low + high) + 0.5 * (high - low) * self.joint_actions
        self._advance()

    def _advance(self) -> None:
        """A control step; RebodyError if a simulation diverged."""
        before = self._root()
        self._simulate()
        self._trail[:, :-1], self._trail[:, -1] = self._trail[:, 1:], before
        self.lying_s[:] = np.where(self.spec.lies(self.qpos), self.lying_s + self.spec.control_dt, 0.0)
        self.pace[:] = self.spec.next_pace(self.pace, self.spec.readout.forward(self._root(), before))

    def _simulate(self) -> None:
        """The physics of a control step."""
        self._batch.step(nstep=self.spec.frame_skip)
        if self._batch.warning[:, _DIVERGED, 1].any():
            raise RebodyError(
                f"the simulation of '{self.spec.name}' diverged; check that its actions are finite, "
                "or lower the model's time step."
            )

    def observe(self):
        """By the robot's observation mapping."""
        return self.spec.readout.observe(self._root(), self._trail[:, 0])

    def pose(self):
        """By the robot's observation mapping."""
        return self.spec.pose(self.qpos)

    def joint_state(self):
        """As `RobotSpec.joint_state` has it."""
        return self.spec.joint_state(self.qpos, self.qvel)

    def proprioception(self):
        """The joint state, and the pace where there is one."""
        return self.spec.tracker_state(self.qpos, self.qvel, self.pace)

    def observation(self):
        """qpos, then qvel."""
        return np.concatenate([self.qpos, self.qvel], axis=-1)

    @property
    def state(self):
        """A copy of mjSTATE_INTEGRATION, `lying_s`, `pace` and the trail."""
        trail = self._trail.reshape(self.size, -1)
        return np.column_stack([self._batch.state, self.lying_s, self.pace, trail])

    @state.setter
    def state(self, value):
        physics, rest = np.split(value, [self._batch.state.shape[1]], axis=1)
        self._batch.state[:] = physics
        self.lying_s[:], self.pace[:] = rest[:, :2].T
        self._trail[:] = rest[:, 2:].reshape(self._trail.shape)
        self._batch.warning[:] = 0

    def _root(self) -> Float[np.ndarray, "robot root"]:
        return self.spec.readout.root(self.qpos)

    def _ids(self, who):
        return np.arange(self.size) if who is None else np.flatnonzero(who)

    def _forget(self, ids) -> None:
        """These stood still."""
        self._trail[ids] = self._root()[ids, None]
