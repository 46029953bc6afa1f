"""Quantities: what of a global state a task is about."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.types import ANGLES, AnyArray, GlobalState

Frame = Literal["world", "heading"]
"""Whether horizontal velocities are along the axes of the world, or along and across the heading."""


@dataclass(frozen=True)
class Quantity:
    """Components of the global state, their unit, and how two values of them differ."""

    name: str
    components: tuple[str, ...]
    """Fields of the global state; the angles among them wrap."""
    unit: str
    label: str
    """In words, for an axis."""
    frame: Frame = "world"

    @property
    def size(self) -> int:
        """How many numbers a value has."""
        return len(self.components)

    @property
    def wraps(self) -> tuple[bool, ...]:
        """Which of them are angles: two values differ by the shorter way round."""
        return tuple(name in ANGLES for name in self.components)

    def read(self, state: GlobalState) -> Float[AnyArray, "*batch size"]:
        """Its value in each state."""
        return (state if self.frame == "world" else along_heading(state)).select(self.components)

    def difference(self, a: Any, b: Any) -> Any:
        """a - b, of arrays [..., size] of NumPy or JAX; of an angle in [-pi, pi)."""
        return wrapped_where(self.wraps, a - b)

    def distance(self, a: Any, b: Any) -> Any:
        """The Euclidean length of the difference, [...]."""
        return length(self.difference(a, b))


def wrapped(angle: Any, unit: Any = 1.0) -> Any:
    """An angle in [-pi, pi), left to the last bit as it is where it lies there already [`unit` rad]."""
    turns = (unit * angle + math.pi) // (2 * math.pi)
    return angle - 2 * math.pi / unit * turns


def wrapped_where(wraps: tuple[bool, ...], difference: Any, units: Any = 1.0) -> Any:
    """Differences [..., axis], those of angles the shorter way round; in units of so many rad."""
    if not any(wraps):
        return difference
    xp = jnp if isinstance(difference, jax.Array) else np
    return xp.where(np.array(wraps), wrapped(difference, units), difference)


def length(vector: Any) -> Any:
    """The Euclidean length of vectors [..., axis]; exact where there is one axis, else 1e-6 at least."""
    if vector.shape[-1] == 1:
        return abs(vector[..., 0])
    return ((vector**2).sum(axis=-1) + 1e-12) ** 0.5  # a root has no slope at 0


def along_heading(state: GlobalState) -> GlobalState:
    """The same with horizontal velocities along (vx) and across (vy, to the left) the heading."""
    xp = jnp if isinstance(state.yaw, jax.Array) else np
    vx, vy = turned(state.vx, state.vy, -state.yaw, xp)
    return GlobalState(**{**vars(state), "vx": xp.asarray(vx), "vy": xp.asarray(vy)})


def turned(x: Any, y: Any, angle: Any, xp: Any) -> tuple[Any, Any]:
    """Horizontal vectors turned by an angle about the vertical."""
    cos, sin = xp.cos(angle), xp.sin(angle)
    return cos * x - sin * y, sin * x + cos * y
