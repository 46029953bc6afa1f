"""The words that every part shares: global state, task, transition, belief, subgoal.

All are pytrees of arrays with any leading batch shape, so they pass through
`jit`, `vmap` and `scan`, and hold JAX or NumPy arrays alike.
"""

from typing import TypeVar

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int

DECISION_DT = 0.1
"""Simulated seconds of one decision, on every body."""

AnyArray = jax.Array | np.ndarray
Tree = TypeVar("Tree")

GLOBAL_FIELDS = ("x", "y", "z", "pitch", "vx", "vy", "vz", "pitch_rate")
RATE_OF = {"vx": "x", "vy": "y", "vz": "z", "pitch_rate": "pitch"}
"""Fields that are displacements over a decision, and what is displaced."""


class GlobalState(eqx.Module):
    """The body-neutral readout of any body, relative to its rest pose.

    Velocities are displacements over the last decision divided by its 0.1 s,
    so they mean the same on a point mass and on a robot.
    """

    x: Float[AnyArray, "*batch"]  # m, forward
    y: Float[AnyArray, "*batch"]  # m, left
    z: Float[AnyArray, "*batch"]  # m, up
    pitch: Float[AnyArray, "*batch"]  # rad, in (-pi, pi]
    vx: Float[AnyArray, "*batch"]  # m/s
    vy: Float[AnyArray, "*batch"]  # m/s
    vz: Float[AnyArray, "*batch"]  # m/s
    pitch_rate: Float[AnyArray, "*batch"]  # rad/s

    def select(self, fields: tuple[str, ...]) -> Float[AnyArray, "*batch field"]:
        """The named fields, stacked on a last axis; of NumPy where they are."""
        chosen = [getattr(self, name) for name in fields]
        return (np if isinstance(chosen[0], np.ndarray) else jax.numpy).stack(chosen, axis=-1)


class Task(eqx.Module):
    """What to do, never told to an agent: a family and one signed number."""

    family: Int[AnyArray, "*batch"]  # index into `rebody.tasks.FAMILIES`
    target: Float[AnyArray, "*batch"]  # m, m/s or rad


class Transition(eqx.Module):
    """What task inference sees of one decision: states and reward, no action (thesis 5.3.3)."""

    previous: GlobalState
    reward: Float[AnyArray, "*batch"]
    state: GlobalState


class Belief(eqx.Module):
    """What the encoder believes: a diagonal Gaussian over the latent task."""

    mean: Float[AnyArray, "*batch latent"]
    variance: Float[AnyArray, "*batch latent"]

    def features(self) -> Float[jax.Array, "*batch twice_latent"]:
        """Mean and standard deviation, as a policy reads them."""
        return jax.numpy.concatenate([self.mean, self.variance**0.5], axis=-1)


class Subgoal(eqx.Module):
    """A scaled one-hot (thesis 5.6.2): the chosen slot beside its value, since a value may be 0.

    A goal is a point in the world, never relative to the robot.
    """

    slot: Int[AnyArray, "*batch"]  # index into `rebody.tasks.FAMILIES`
    value: Float[AnyArray, "*batch"]  # m (in the world), m/s or rad
