"""The flat policy (thesis 6.3.2): (joint state, x, belief) -> joint action, with no hierarchy in between."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.sac import Actor
from rebody.types import AnyArray, Belief


class FlatPolicy(eqx.Module):
    """An actor with its fixed input scaling."""

    actor: Actor
    reach: float = eqx.field(static=True)
    """What x is divided by [m]."""

    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], belief: Belief
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""
        return self.actor(flat_observation(joints, x, belief, self.reach))


def flat_observation(
    joints: Float[AnyArray, "*batch joint"], x: Float[AnyArray, "*batch"], belief: Belief, reach: float
) -> Float[AnyArray, "*batch feature"]:
    """Joint state, scaled x (a belief tells of points in the world), then the belief."""
    return jnp.concatenate([joints, x[..., None] / reach, belief.features()], axis=-1)
