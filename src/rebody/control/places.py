"""Places: how beliefs and tasks speak to policies, a vector for each family's quantity."""

from collections.abc import Sequence
from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from rebody.ranges import Box, Positive
from rebody.tasks.family import Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.quantities import Quantity, length, wrapped_where
from rebody.types import AnyArray, Belief, GlobalState, Task

FARTHEST = 2.0
"""A place is seen as this far ahead at most, in units of its scale: one farther off asks for nothing else."""
UNBOUNDED = ("x", "y", "yaw")
"""Fields without a rest to tell them from: they are seen from where the body is."""


@dataclass(frozen=True)
class Place:
    """Where one family's quantity is to be brought, in units of its scales."""

    quantity: Quantity
    scales: tuple[Positive, ...]
    """What each component is divided by [m, rad, m/s]."""

    @property
    def size(self) -> int:
        """How many numbers it has."""
        return self.quantity.size

    def here(self, state: GlobalState) -> Float[AnyArray, "*batch size"]:
        """Where the body is, in the same units."""
        return self.quantity.read(state) / jnp.asarray(self.scales)


def reachable(family: Family, reach: Box | None) -> Box:
    """All between a family's smallest and largest targets, but no speed or attitude that a robot does not reach.

    Places may lie farther off than a tracker is shown them; None where a robot sets no limits.
    """
    if reach is None:
        return family.range
    is_far = [name in UNBOUNDED for name in family.quantity.components]
    ends = (family.range.low, family.range.high)
    low, high = (np.where(is_far, end, np.clip(end, reach.low, reach.high)).tolist() for end in ends)
    return Box(tuple(low), tuple(high))


Places = tuple[Place, ...]
"""One for each family of a module, in its order; none for a belief that is seen as it is."""


def places_of(families: FamilySet) -> Places:
    """Those of a set, in units of the largest targets."""
    return tuple(Place(each.quantity, tuple(end or 1.0 for end in each.range.largest)) for each in families)


def numbers_of(places: Places) -> int:
    """How many numbers all of them have together."""
    return sum(place.size for place in places)


def owners(places: Places) -> Int[np.ndarray, " number"]:
    """Whose number each is."""
    return np.repeat(np.arange(len(places)), [place.size for place in places])


def split_places(places: Places, numbers: Float[AnyArray, "*batch number"]) -> Sequence[Float[AnyArray, "*batch _"]]:
    """The numbers of each."""
    return jnp.split(jnp.asarray(numbers), np.cumsum([place.size for place in places])[:-1], axis=-1)


def lengths(places: Places, numbers: Float[AnyArray, "*batch number"]) -> Float[AnyArray, "*batch place"]:
    """How long each place's vector is."""
    return jnp.stack([length(vector) for vector in split_places(places, numbers)], axis=-1)


def seen_from(
    places: Places, here: Sequence[Float[AnyArray, "*batch _"]], understood: Belief
) -> Float[AnyArray, "*batch feature"]:
    """What an interpreted belief (mean [share of each place, its numbers]) says, from where the body is: how likely
    each place is meant, how far ahead it is, how far that is from zero, and how sure.
    """
    share, place = jnp.split(understood.mean, [len(places)], axis=-1)
    doubt = understood.variance[..., len(places) :] ** 0.5
    there = split_places(places, place)
    ahead = jnp.concatenate([_difference(*each) for each in zip(places, there, here, strict=True)], axis=-1)
    ahead = jnp.clip(ahead, -FARTHEST, FARTHEST)
    # the likeliest one's place as it is: a share of 0.998 would put it 3 cm short of 15 m
    gate = share / jnp.max(share, axis=-1, keepdims=True)
    of_each = gate[..., owners(places)]
    return jnp.concatenate([share, of_each * ahead, gate * lengths(places, place), of_each * doubt], axis=-1)


def _difference(place: Place, there, here):
    """In units of its scales; angles the shorter way round."""
    return wrapped_where(place.quantity.wraps, there - here, np.array(place.scales, np.float32))


class TaskCode(eqx.Module):
    """A task in the shape of a belief without doubt, for a privileged policy."""

    places: Places = eqx.field(static=True)

    def __call__(self, task: Task) -> Belief:
        """One-hot of the family, then the same times the scaled target; mean [*batch, places + their numbers]."""
        is_on = jnp.stack([task.family == i for i in range(len(self.places))], axis=-1).astype(jnp.float32)
        targets = [task.target[..., : place.size] / jnp.asarray(place.scales) for place in self.places]
        target = is_on[..., owners(self.places)] * jnp.concatenate(targets, axis=-1)
        mean = jnp.concatenate([is_on, target], axis=-1)
        return Belief(mean, jnp.zeros_like(mean))
