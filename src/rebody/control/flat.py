"""Policies without hierarchy (thesis 6.3.2): (joint state, x, belief) -> joint action."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.high_level import Places, seen_from
from rebody.control.sac import Actor
from rebody.types import AnyArray, Belief


@dataclass(frozen=True)
class FlatView:
    """What a policy without hierarchy sees: a vector of so many scaled numbers."""

    places: Places = ()
    """What a belief says the places of; none for one that is seen as it is."""
    reach: float = 1.0
    """What x is divided by then [m]."""

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], understood: Belief
    ) -> Float[AnyArray, "*batch feature"]:
        """Joint state, then what is believed (`Decoder.interpret`).

        That is x and the belief as it is, which tells of points in the world; or the places that it says, those of x
        from where the body is. How fast it moves and how it is pitched the joint state has already.
        """
        if not self.places:
            return jnp.concatenate([joints, x[..., None] / self.reach, understood.features()], axis=-1)
        here = [x / unit if field == "x" else jnp.zeros_like(x) for field, unit in self.places]
        return jnp.concatenate([joints, seen_from(jnp.stack(here, axis=-1), understood)], axis=-1)

    def size(self, joints: int, latent: int) -> int:
        """How many numbers it sees, with so many of the joints and of the latent."""
        return joints + (4 * len(self.places) if self.places else 1 + 2 * latent)


class FlatPolicy(eqx.Module):
    """An actor with what it sees."""

    actor: Actor
    view: FlatView = eqx.field(static=True)

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], understood: Belief
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]; `understood` is what the decoder makes of a belief."""
        return self.actor(self.view(joints, x, understood))
