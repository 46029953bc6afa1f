"""What an environment needs of bodies: any number of copies that reset one by one and step together."""

from typing import Any

import equinox as eqx
import jax
import mujoco
import numpy as np
from jaxtyping import Array, Float

from rebody.bodies import RobotBatch, RobotSpec
from rebody.bodies.toy_models import mass_damper_model
from rebody.bodies.toys import MassDamper
from rebody.jax_settings import own_jax_settings
from rebody.types import GlobalState, global_state


class PointMasses:
    """Nominal mass-dampers, at rest after a reset. A step is a decision of 0.1 s."""

    actions, root = 1, 1
    """Numbers in the action of one body, each in [-1, 1], and the id in the model of what a camera follows."""

    def __init__(self, size: int):
        self.size = size
        self._toy = MassDamper()
        self._x = np.zeros(size, np.float32)
        self._vx = np.zeros(size, np.float32)

    @property
    def model(self) -> mujoco.MjModel:
        """The toy's MuJoCo model."""
        return mass_damper_model(self._toy)

    @property
    def qpos(self) -> Float[np.ndarray, "body 1"]:
        """x [m]."""
        return self._x[:, None].astype(np.float64)

    @property
    def qvel(self) -> Float[np.ndarray, "body 1"]:
        """vx [m/s]."""
        return self._vx[:, None].astype(np.float64)

    def reset(self, body: int, rng: np.random.Generator) -> None:
        """Put one point mass at rest at x = 0."""
        self._x[body] = self._vx[body] = 0.0

    @own_jax_settings()
    def step(self, actions: Float[np.ndarray, "body 1"]) -> None:
        """One decision of every point mass."""
        x, vx = _advance(self._toy, self._x, self._vx, actions.astype(np.float32))
        self._x, self._vx = np.array(x), np.array(vx)

    def global_state(self) -> GlobalState:
        """The readout of every point mass."""
        return global_state(x=self._x, vx=self._vx)


@eqx.filter_jit
def _advance(toy, x, vx, actions) -> tuple[Float[Array, " body"], Float[Array, " body"]]:
    # a nominal toy has no noise, so its key does not matter
    state = toy.step(toy.initial(x, vx), actions, jax.random.key(0))
    return state.x, state.vx


class Robots:
    """Copies of one robot. A step is a control step."""

    def __init__(self, spec: RobotSpec, size: int, threads: int = 0):
        """`threads` = 0 uses every processor."""
        self.size = size
        self.actions, self.root = spec.model.nu, spec.root_body
        self._spec, self._threads = spec, threads
        self._batch = RobotBatch(spec, size, threads)
        self._past_qpos = np.zeros((spec.steps_per_decision + 1, size, spec.model.nq))

    def __getstate__(self) -> dict[str, Any]:
        # MuJoCo's batch cannot be copied; the numbers that it continues from can
        return vars(self) | {"_batch": self._batch.state}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        self._batch = RobotBatch(self._spec, self.size, self._threads)
        self._batch.state = state["_batch"]

    @property
    def model(self) -> mujoco.MjModel:
        """The robot's own model."""
        return self._spec.model

    @property
    def qpos(self) -> Float[np.ndarray, "body nq"]:
        """Joint positions, x among them [m, rad]."""
        return self._batch.qpos.copy()

    @property
    def qvel(self) -> Float[np.ndarray, "body nv"]:
        """Joint velocities [m/s, rad/s]."""
        return self._batch.qvel.copy()

    def reset(self, body: int, rng: np.random.Generator) -> None:
        """Put one robot at x = 0 in its rest pose, with its reset noise."""
        self._batch.reset(rng, np.arange(self.size) == body)
        self._past_qpos[:, body] = self._batch.qpos[body]

    def step(self, actions: Float[np.ndarray, "body action"]) -> None:
        """One control step of every robot."""
        self._batch.step(actions)
        self._past_qpos = np.concatenate([self._past_qpos[1:], self._batch.qpos[None]])

    def global_state(self) -> GlobalState:
        """The readout of every robot; before its first step each counts as having stood still."""
        return self._spec.observe(self._past_qpos[-1], self._past_qpos[0])


Bodies = PointMasses | Robots
