"""The words that every part shares: global state, task, transition, belief, subgoal.

All are pytrees of arrays with any leading batch shape, so they pass through
`jit`, `vmap` and `scan`, and hold JAX or NumPy arrays alike.
"""

from typing import Any, TypeVar

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Float, Int

DECISION_DT = 0.1
"""Simulated seconds of one decision, on every body."""

AnyArray = jax.Array | np.ndarray
Tree = TypeVar("Tree")

POSE_FIELDS = ("x", "y", "z", "roll", "pitch", "yaw")
RATE_FIELDS = ("vx", "vy", "vz", "roll_rate", "pitch_rate", "yaw_rate")
GLOBAL_FIELDS = POSE_FIELDS + RATE_FIELDS
ANGLES = ("roll", "pitch", "yaw")
"""Two values of these differ by the shorter way round."""
RATE_OF: dict[str, str] = dict(zip(RATE_FIELDS, POSE_FIELDS, strict=True))
"""Fields that are displacements over a decision, and what is displaced."""


class GlobalState(eqx.Module):
    """The body-neutral readout of any body, relative to its rest pose.

    The attitude is that of a turn by yaw (about z), then by pitch (about the new y), then by roll (about the new x).
    Velocities are displacements over the last decision divided by its 0.1 s,
    so they mean the same on a point mass and on a robot.
    """

    x: Float[AnyArray, "*batch"]  # m, forward
    y: Float[AnyArray, "*batch"]  # m, left
    z: Float[AnyArray, "*batch"]  # m, up
    roll: Float[AnyArray, "*batch"]  # rad, in (-pi, pi]
    pitch: Float[AnyArray, "*batch"]  # rad, in (-pi, pi]
    yaw: Float[AnyArray, "*batch"]  # rad, in (-pi, pi], the heading
    vx: Float[AnyArray, "*batch"]  # m/s
    vy: Float[AnyArray, "*batch"]  # m/s
    vz: Float[AnyArray, "*batch"]  # m/s
    roll_rate: Float[AnyArray, "*batch"]  # rad/s
    pitch_rate: Float[AnyArray, "*batch"]  # rad/s
    yaw_rate: Float[AnyArray, "*batch"]  # rad/s

    def select(self, fields: tuple[str, ...]) -> Float[AnyArray, "*batch field"]:
        """The named fields, stacked on a last axis; of NumPy where they are."""
        chosen = [getattr(self, name) for name in fields]
        return (np if isinstance(chosen[0], np.ndarray) else jax.numpy).stack(chosen, axis=-1)


def global_state(**fields: Float[AnyArray, "*batch"]) -> GlobalState:
    """A global state of which only these fields, all of one shape, are not zero."""
    some = next(iter(fields.values()))
    still = (np if isinstance(some, np.ndarray) else jax.numpy).zeros_like(some)
    values: dict[str, Any] = dict.fromkeys(GLOBAL_FIELDS, still)
    return GlobalState(**(values | fields))


Pose = Float[AnyArray, "*batch 6"]
"""The fields of `POSE_FIELDS` at one moment, in their order [m, rad]."""


class Task(eqx.Module):
    """What to do, never told to an agent: a family and a target."""

    family: Int[AnyArray, "*batch"]  # index into a `rebody.tasks.FamilySet`
    target: Float[AnyArray, "*batch axis"]  # in the units of its quantity, zeros behind its size


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

    A place is a point in the world, never relative to the robot.
    """

    slot: Int[AnyArray, "*batch"]  # index into a `rebody.tasks.FamilySet`
    value: Float[AnyArray, "*batch axis"]  # in the units of its quantity, zeros behind its size
