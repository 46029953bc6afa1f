"""The high-level policy: (global state, belief) -> action of the toy."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.sac import Actor, SACConfig
from rebody.ranges import Positive
from rebody.tasks.families import FAMILIES
from rebody.types import AnyArray, Belief, GlobalState, Task

Places = tuple[tuple[str, Positive], ...]
"""Fields that a belief says the places of, and what both are divided by."""
FARTHEST = 2.0
"""A place is seen as this far ahead at most, in units of its scale: one farther off asks for nothing else."""


def high_level_sac(projections: int, decay_updates: int) -> SACConfig:
    """How high-level policies learn, on the toy and on a robot: small networks that look 2 s ahead."""
    return SACConfig(
        hidden=(128, 128),
        projections=projections,
        discount=0.95,
        learning_rate=5e-4,
        decay_updates=decay_updates,
        huber=0.05,
    )


@dataclass(frozen=True)
class PolicyView:
    """What a high-level policy sees of a global state and a belief: a vector of so many scaled numbers."""

    fields: tuple[str, ...]
    """Of the global state."""
    scales: tuple[Positive, ...]
    """What each of them is divided by."""
    places: Places = ()
    """What a belief says the places of; none for one that is seen as it is."""

    def __call__(self, state: GlobalState, belief: Belief) -> Float[AnyArray, "*batch feature"]:
        """Scaled fields of the global state, then what is believed.

        That is mean and standard deviation of a belief; one that says places (`Decoder.interpret`, `TaskCode`) is seen
        from where the body is: how likely each field is meant, how far ahead its place is, how far that is from zero
        (which is what a relative reward is relative to), and how sure. Far from home and near it are the same then.
        """
        here = state.select(self.fields) / jnp.asarray(self.scales)
        if not self.places:
            return jnp.concatenate([here, belief.features()], axis=-1)
        names, units = zip(*self.places, strict=True)
        return jnp.concatenate([here, seen_from(state.select(names) / jnp.asarray(units), belief)], axis=-1)

    def size(self, believed: int) -> int:
        """How many numbers it sees, with a belief of so many."""
        return len(self.fields) + (4 * len(self.places) if self.places else 2 * believed)


def seen_from(here: Float[AnyArray, "*batch field"], understood: Belief) -> Float[AnyArray, "*batch four_times_field"]:
    """The places that an interpreted belief speaks of, from where the body's scaled fields are."""
    share, place = jnp.split(understood.mean, 2, axis=-1)
    _, doubt = jnp.split(understood.variance**0.5, 2, axis=-1)
    ahead = jnp.clip(place - here, -FARTHEST, FARTHEST)
    # the likeliest field's place as it is: a share of 0.998 would put it 3 cm short of 15 m
    gate = share / jnp.max(share, axis=-1, keepdims=True)
    return jnp.concatenate([share, gate * ahead, gate * jnp.abs(place), gate * doubt], axis=-1)


class HighLevelPolicy(eqx.Module):
    """An actor with what it sees."""

    actor: Actor
    view: PolicyView = eqx.field(static=True)

    def __call__(self, state: GlobalState, belief: Belief) -> Float[AnyArray, "*batch action"]:
        """The most likely action, in [-1, 1]."""
        return self.actor(self.view(state, belief))


class TaskCode(eqx.Module):
    """A task in the shape of a belief without doubt, for a policy that is told it."""

    scales: tuple[tuple[int, float], ...] = eqx.field(static=True)
    """Each family's index, and what its targets are divided by [m, m/s, rad]."""

    @property
    def places(self) -> Places:
        """The field of each family, and its scale."""
        return tuple((FAMILIES[family].quantity.name, scale) for family, scale in self.scales)

    def __call__(self, task: Task) -> Belief:
        """One-hot of the family, then the same times the scaled target; mean [*batch, 2 families]."""
        is_on = jnp.stack([(task.family == family) for family, _ in self.scales], axis=-1).astype(jnp.float32)
        target = task.target[..., None] / jnp.asarray([scale for _, scale in self.scales])
        mean = jnp.concatenate([is_on, is_on * target], axis=-1)
        return Belief(mean, jnp.zeros_like(mean))


def told_code(places: Places) -> TaskCode:
    """How a task is put to a policy that is told it: as a belief without doubt that speaks of these places."""
    family_of = {family.quantity.name: index for index, family in enumerate(FAMILIES)}
    return TaskCode(tuple((family_of[field], unit) for field, unit in places))
