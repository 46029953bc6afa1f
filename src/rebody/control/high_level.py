"""The high-level policy: (global state, belief) -> action of the toy."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.sac import Actor
from rebody.types import AnyArray, Belief, GlobalState


class HighLevelPolicy(eqx.Module):
    """An actor with its fixed input scaling."""

    actor: Actor
    fields: tuple[str, ...] = eqx.field(static=True)
    scales: tuple[float, ...] = eqx.field(static=True)

    def __call__(self, state: GlobalState, belief: Belief) -> Float[AnyArray, "*batch action"]:
        """The most likely action, in [-1, 1]."""
        return self.actor(policy_observation(state, belief, self.fields, self.scales))


def policy_observation(
    state: GlobalState, belief: Belief, fields: tuple[str, ...], scales: tuple[float, ...]
) -> Float[AnyArray, "*batch feature"]:
    """Scaled fields of the global state, then mean and standard deviation of the belief."""
    return jnp.concatenate([state.select(fields) / jnp.asarray(scales), belief.features()], axis=-1)
