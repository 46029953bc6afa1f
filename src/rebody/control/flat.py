"""Policies without hierarchy (thesis 6.3.2): (joint state, pose, belief) -> joint action."""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.places import UNBOUNDED, Place, Places, numbers_of, seen_from
from rebody.control.sac import Actor
from rebody.types import POSE_FIELDS, AnyArray, Belief, Pose


@dataclass(frozen=True)
class FlatView:
    """What a policy without hierarchy sees: a vector of so many scaled numbers."""

    places: Places = ()
    """What a belief says the places of; none for one that is seen as it is."""
    reach: float = 1.0
    """What x is divided by then [m]."""

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], pose: Pose, understood: Belief
    ) -> Float[AnyArray, "*batch feature"]:
        """Joint state, then what is believed (`Decoder.interpret`).

        That is x and the belief as it is, which tells of points in the world; or the places that it says, those on the
        floor from where the body is. How fast it moves and how it is pitched the joint state has already.
        """
        if not self.places:
            return jnp.concatenate([joints, pose[..., :1] / self.reach, understood.features()], axis=-1)
        here = [_here(place, pose) for place in self.places]
        return jnp.concatenate([joints, seen_from(self.places, here, understood)], axis=-1)

    def size(self, joints: int, latent: int) -> int:
        """How many numbers it sees, with so many of the joints and of the latent."""
        return joints + (2 * (len(self.places) + numbers_of(self.places)) if self.places else 1 + 2 * latent)


def _here(place: Place, pose: Pose) -> Float[AnyArray, "*batch size"]:
    still = jnp.zeros(pose.shape[:-1])
    numbers = [
        pose[..., POSE_FIELDS.index(name)] / scale if name in UNBOUNDED else still
        for name, scale in zip(place.quantity.components, place.scales, strict=True)
    ]
    return jnp.stack(numbers, axis=-1)


class FlatPolicy(eqx.Module):
    """An actor with what it sees."""

    actor: Actor
    view: FlatView = eqx.field(static=True)

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], pose: Pose, understood: Belief
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]; `understood` is what the decoder makes of a belief."""
        return self.actor(self.view(joints, pose, understood))
