"""The high-level policy: (global state, belief) -> action of the toy."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.places import Places, numbers_of, seen_from
from rebody.control.sac import Actor, SACConfig
from rebody.ranges import Positive
from rebody.types import AnyArray, Belief, GlobalState


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
        from where the body is. Far from home and near it are the same then.
        """
        here = state.select(self.fields) / jnp.asarray(self.scales)
        if not self.places:
            return jnp.concatenate([here, belief.features()], axis=-1)
        seen = seen_from(self.places, [place.here(state) for place in self.places], belief)
        return jnp.concatenate([here, seen], axis=-1)

    def size(self, believed: int) -> int:
        """How many numbers it sees, with a belief of so many."""
        return len(self.fields) + (2 * (len(self.places) + numbers_of(self.places)) if self.places else 2 * believed)


class HighLevelPolicy(eqx.Module):
    """An actor with what it sees."""

    actor: Actor
    view: PolicyView = eqx.field(static=True)

    def __call__(self, state: GlobalState, belief: Belief) -> Float[AnyArray, "*batch action"]:
        """The most likely action, in [-1, 1]."""
        return self.actor(self.view(state, belief))
