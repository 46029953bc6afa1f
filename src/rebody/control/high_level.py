"""The high-level policy: (global state, belief) -> action of the toy."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.sac import Actor
from rebody.types import AnyArray, Belief, GlobalState, Task


class HighLevelPolicy(eqx.Module):
    """An actor with its fixed input scaling."""

    actor: Actor
    fields: tuple[str, ...] = eqx.field(static=True)
    scales: tuple[float, ...] = eqx.field(static=True)

    def __call__(self, state: GlobalState, belief: Belief) -> Float[AnyArray, "*batch action"]:
        """The most likely action, in [-1, 1]."""
        return self.actor(policy_observation(state, belief, self.fields, self.scales))


class TaskCode(eqx.Module):
    """A task in the shape of a belief without doubt, for a policy that is told it."""

    scales: tuple[tuple[int, float], ...] = eqx.field(static=True)
    """Each family's index, and what its targets are divided by [m, m/s, rad]."""

    def __call__(self, task: Task) -> Belief:
        """One-hot of the family, then the same times the scaled target; mean [*batch, 2 families]."""
        is_on = jnp.stack([(task.family == family) for family, _ in self.scales], axis=-1).astype(jnp.float32)
        target = task.target[..., None] / jnp.asarray([scale for _, scale in self.scales])
        mean = jnp.concatenate([is_on, is_on * target], axis=-1)
        return Belief(mean, jnp.zeros_like(mean))


def policy_observation(
    state: GlobalState, belief: Belief, fields: tuple[str, ...], scales: tuple[float, ...]
) -> Float[AnyArray, "*batch feature"]:
    """Scaled fields of the global state, then mean and standard deviation of the belief."""
    return jnp.concatenate([state.select(fields) / jnp.asarray(scales), belief.features()], axis=-1)
