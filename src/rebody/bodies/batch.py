"""Many copies of one robot, stepped at once by MuJoCo's own batch engine: the only file that knows `mujoco.batch`."""

import mujoco
import mujoco.batch
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.robot import RobotSpec
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
        qpos = self.spec.rest_qpos + rng.uniform(-noise, noise, (ids.size, model.nq))
        for pose in qpos:
            mujoco.mj_normalizeQuat(model, pose)
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
