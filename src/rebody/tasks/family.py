"""A family of tasks: which quantity is to reach a target, and what is paid for it."""

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
import scipy.stats
from jaxtyping import Float, Int
from msgspec import Meta

from rebody.errors import RebodyError
from rebody.ranges import Box, Finite, Positive
from rebody.tasks.laws import LAWS, RewardLaw, law_named
from rebody.tasks.quantities import Quantity
from rebody.types import GLOBAL_FIELDS, RATE_OF, AnyArray

Settle = Literal["last", "mean of 1 s", "largest of 1 s"]
"""What of a quantity is judged at a moment: its value there, or what it was over the second before."""
Name = Annotated[str, Meta(max_length=60, pattern=r"^[A-Za-z][A-Za-z0-9_]*$")]
"""Of a family, a quantity or a direction."""
Colour = Annotated[str, Meta(pattern=r"^#[0-9a-fA-F]{6}$")]
POINTS = 512
"""Of a Gaussian, by which the chances of directions are told."""


@dataclass(frozen=True)
class Direction:
    """A name for the targets that are nearest to a vector: front and back, or a sector of the plane."""

    name: Name
    towards: tuple[Finite, ...]


@dataclass(frozen=True)
class Family:
    """One kind of task: which quantity of the body is to reach the target. Data alone: artifacts hold it whole."""

    name: Name
    quantity: Quantity
    targets: tuple[Box, ...]
    """Base tasks: ranges of targets, each as likely as any other (thesis 6.2)."""
    floor: Positive
    """Smallest size of a target that a relative reward divides by, in the quantity's unit."""
    tolerance: Positive
    """An episode counts as solved when its final error is within this, in the quantity's unit."""
    law: str = "relative"
    """Name of its reward law."""
    settle: Settle = "last"
    """How errors are taken: a gait makes velocities uneven, and nobody can hold a jump."""
    label: str = ""
    """What it asks for, in words."""
    colour: Colour = "#6a4c93"
    """In figures and on the live page."""
    directions: tuple[Direction, ...] = ()
    """By which belief and truth are compared before a target is known sharply; none for one direction."""
    law_source: str = ""
    """SHA-256 of the file that its law comes from; none for a law of the package."""

    def __post_init__(self):
        """ValueError for what cannot be asked."""
        quantity = self.quantity
        if not quantity.components or len(set(quantity.components)) < quantity.size:
            raise ValueError("quantity.components: there must be at least one, and none twice")
        if unknown := [name for name in quantity.components if name not in GLOBAL_FIELDS]:
            known = ", ".join(GLOBAL_FIELDS)
            raise ValueError(f"quantity.components: '{unknown[0]}' is unknown; a global state has {known}")
        if not self.targets or any(box.size != quantity.size for box in self.targets):
            raise ValueError(f"targets: '{quantity.name}' has {quantity.size} numbers, so must their ends")
        if all(box.largest == (0.0,) * box.size for box in self.targets):
            raise ValueError("targets: there must be one that is not 0")
        if any(len(direction.towards) != quantity.size for direction in self.directions):
            raise ValueError(f"directions: each must point to {quantity.size} numbers")
        if self.law not in LAWS or self.law_source not in ("", LAWS[self.law].source):
            raise ValueError(
                f"law: '{self.law}' is not known as it was; name the file that defines it, --families FILE"
            )

    @property
    def unit(self) -> str:
        """Of its targets."""
        return self.quantity.unit

    @property
    def size(self) -> int:
        """How many numbers a target has."""
        return self.quantity.size

    @property
    def reward_law(self) -> RewardLaw:
        """What is paid."""
        return law_named(self.law)

    @property
    def range(self) -> Box:
        """Between which ends all targets lie."""
        boxes = [box.around for box in self.targets]
        low = tuple(map(min, zip(*(box.low for box in boxes), strict=True)))
        high = tuple(map(max, zip(*(box.high for box in boxes), strict=True)))
        return Box(low, high)

    @property
    def is_pose(self) -> bool:
        """Whether it asks for a place or an attitude, which a robot sees from where it is, and not for speeds."""
        return not set(self.quantity.components) & set(RATE_OF)

    def within(self, *targets: Box, law: str | None = None) -> "Family":
        """The same family with other base tasks, and another law where one is given; RebodyError where none can be."""
        try:
            return replace(self, targets=targets, law=self.law if law is None else law)
        except ValueError as error:
            raise RebodyError(f"family '{self.name}': {error}.") from None

    @property
    def direction_names(self) -> tuple[str, ...]:
        """By their indices; one without a name where targets have none."""
        return tuple(direction.name for direction in self.directions) or ("",)

    def direction(self, target: Any) -> Int[AnyArray, "*batch"]:
        """Index of the direction of targets [*batch, size], of NumPy or JAX; 0 where the family has none."""
        xp = jnp if isinstance(target, jax.Array) else np
        target = xp.asarray(target)
        if not self.directions:
            return xp.zeros(target.shape[:-1], int)
        apart = [self.quantity.distance(target, xp.asarray(each.towards)) for each in self.directions]
        return xp.asarray(xp.argmin(xp.stack(apart, axis=-1), axis=-1))

    def direction_chances(self, mean: Any, std: Any) -> Float[np.ndarray, " direction"]:
        """How likely each direction is under a diagonal Gaussian over the target, [size] each."""
        points = np.asarray(mean) + np.asarray(std) * _gaussian_points(self.size)
        return np.bincount(self.direction(points), minlength=len(self.direction_names)) / POINTS

    def admit(self, target: Any) -> tuple[float, ...]:
        """A target as a vector; RebodyError where it has another size. A number is a vector of one."""
        vector = tuple(map(float, target)) if isinstance(target, list | tuple) else (float(target),)
        if len(vector) != self.size:
            components = ", ".join(self.quantity.components)
            raise RebodyError(f"a target of '{self.name}' has {self.size} numbers ({components}), not {len(vector)}.")
        return vector


def _gaussian_points(size: int) -> Float[np.ndarray, "point size"]:
    """As even as can be, the same each time."""
    if size == 1:
        return scipy.stats.norm.ppf((np.arange(POINTS) + 0.5) / POINTS)[:, None]
    even = scipy.stats.qmc.Halton(size, scramble=False).random(POINTS + 1)[1:]
    return scipy.stats.norm.ppf(even)
