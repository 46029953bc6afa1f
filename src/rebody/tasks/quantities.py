"""Quantities: what of a global state a task is about."""

import math
from dataclasses import dataclass
from typing import Any

from jaxtyping import Float

from rebody.types import AnyArray, GlobalState


@dataclass(frozen=True)
class Quantity:
    """Components of the global state, their unit, and how two values of them differ."""

    name: str
    components: tuple[str, ...]
    """Fields of the global state."""
    unit: str
    label: str
    """In words, for an axis."""
    wraps: bool = False
    """Whether it is an angle: two values differ by the shorter way round."""

    def read(self, state: GlobalState) -> Float[AnyArray, "*batch size"]:
        """Its value in each state."""
        return state.select(self.components)

    def difference(self, a: Any, b: Any) -> Any:
        """a - b, of numbers or of arrays of NumPy or JAX; of an angle in (-pi, pi]."""
        return wrapped(a - b) if self.wraps else a - b


def wrapped(angle: Any) -> Any:
    """An angle in [-pi, pi), left to the last bit as it is where it lies there already [rad]."""
    turns = (angle + math.pi) // (2 * math.pi)
    return angle - 2 * math.pi * turns


X = Quantity("x", ("x",), "m", "position x")
VX = Quantity("vx", ("vx",), "m/s", "velocity")
PITCH = Quantity("pitch", ("pitch",), "rad", "pitch", wraps=True)
VZ = Quantity("vz", ("vz",), "m/s", "vertical speed")
