"""Point masses as bodies that are simulated from outside, a decision at a time."""

from collections.abc import Sequence
from functools import cached_property

import equinox as eqx
import jax
import mujoco
import numpy as np
from jaxtyping import Float

from rebody.bodies.simulation import Simulation
from rebody.bodies.toy_models import toy_model
from rebody.bodies.toys import AXES, RATES, Toy
from rebody.jax_settings import own_jax_settings
from rebody.types import POSE_FIELDS, AnyArray, global_state

FIELDS = AXES + RATES
"""What a nominal toy continues from; a state has them in this order."""
JOINTS = ("x", "y", "z", "yaw", "pitch")
"""Axes in the order of a model's joints."""
ANYWHERE = ("x", "y", "yaw")
"""Where a body may be and face without being another one."""


class PointMasses(Simulation):
    """Nominal toys, at rest after a reset. A step is a decision of 0.1 s."""

    steps_per_decision, root = 1, 1

    def __init__(self, toy: Toy, size: int):
        self.size, self.actions, self._toy = size, toy.actions, toy
        self._state = np.zeros((size, len(FIELDS)), np.float32)

    @cached_property
    def model(self) -> mujoco.MjModel:
        """The toy's MuJoCo model."""
        return toy_model(self._toy)

    def picture_pose(self):
        """Its joints."""
        return self._of(self._joints).astype(np.float64)

    def reset(self, rng, who=None):
        """There is no noise."""
        self._state[slice(None) if who is None else who] = 0.0

    def place(self, x, y=None, yaw=None, who=None):
        """Where it can move to."""
        for axis, value in (("x", x), ("y", y), ("yaw", yaw)):
            if value is not None and axis in self._joints:
                self._state[slice(None) if who is None else who, FIELDS.index(axis)] = value

    def push(self, change):
        """A position toy, which moves by steps and has no momentum, does not mind."""
        for axis, value in zip(("x", "y"), np.atleast_2d(change.T), strict=False):
            if axis in self._joints:
                self._state[:, FIELDS.index(axis) + len(AXES)] += value

    @own_jax_settings()
    def step(self, actions):
        """One decision."""
        self.joint_actions = np.clip(actions, -1.0, 1.0)
        self._state = np.array(_advance(self._toy, self._state, actions.astype(np.float32)))

    def observe(self):
        """The toy's own readout."""
        state = self._state.copy()
        return global_state(**{name: state[:, i] for i, name in enumerate(FIELDS)})

    def pose(self):
        """The pose of what is observed."""
        return self.observe().select(POSE_FIELDS).astype(np.float64)

    def joint_state(self):
        """All but where it is and faces."""
        inner = [axis for axis in self._joints if axis not in ANYWHERE]
        return np.concatenate([self._of(inner), self._rates], axis=-1).astype(np.float32)

    def observation(self):
        """As the model has them."""
        return np.concatenate([self.picture_pose(), self._rates], axis=-1).astype(np.float64)

    @property
    def _joints(self) -> list[str]:
        return [axis for axis in JOINTS if axis in self._toy.axes]

    @property
    def _rates(self) -> Float[np.ndarray, "body joint"]:
        return self._of([RATES[AXES.index(axis)] for axis in self._joints])

    def _of(self, fields: Sequence[str]) -> Float[np.ndarray, "body field"]:
        return self._state[:, [FIELDS.index(field) for field in fields]]

    @property
    def fallen(self):
        """None ever."""
        return np.zeros(self.size, np.bool_)

    @property
    def state(self):
        """A copy."""
        return self._state.copy()

    @state.setter
    def state(self, value):
        self._state[:] = value


@eqx.filter_jit
def _advance(
    toy: Toy, state: Float[AnyArray, "body field"], actions: Float[AnyArray, "body action"]
) -> Float[AnyArray, "body field"]:
    here = global_state(**{name: state[:, i] for i, name in enumerate(FIELDS)})
    # a nominal toy has no noise, so its key does not matter
    return toy.observe(toy.step(toy.begin(here), actions, jax.random.key(0))).select(FIELDS)
