"""A high-level policy that was learned on a robot (thesis 5.6.2, 6.5): a value per slot, the largest is the subgoal."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.bodies.robot import Reach
from rebody.control.high_level import PolicyView
from rebody.control.sac import Actor, Critics, SACConfig
from rebody.tasks import FAMILIES, GOAL
from rebody.types import AnyArray, Belief, GlobalState, Subgoal

Slots = tuple[tuple[int, float], ...]
"""Of each slot the family, and what a value of 1 asks for [m ahead of the robot, m/s, rad]."""
SOFTNESS = 0.1
"""While it learns, a slot is drawn by a softmax of |value| over this; at test time the argmax is used."""


class SlotPolicy(eqx.Module):
    """(global state, belief) -> subgoal."""

    actor: Actor
    view: PolicyView = eqx.field(static=True)
    slots: Slots = eqx.field(static=True)

    def __call__(self, state: GlobalState, belief: Belief) -> Subgoal:
        """The subgoal of the largest |value|."""
        return subgoal_of(pool(self.actor(self.view(state, belief))), state, self.slots)


def slots_within(families: tuple[int, ...], reach: Reach) -> Slots:
    """A slot for each family, its scale the largest that may be asked of the robot."""
    return tuple((family, max(map(abs, reach.limits[FAMILIES[family].name]))) for family in families)


def pool(values: Float[AnyArray, "*batch slot"]) -> Float[AnyArray, "*batch slot"]:
    """The largest |value| with its sign, zero in all other slots."""
    return _keep(values, jnp.abs(values))


def draw(values: Float[AnyArray, "*batch slot"], key: PRNGKeyArray) -> Float[AnyArray, "*batch slot"]:
    """Pooled, but the slot drawn by a softmax of |value|."""
    return _keep(values, jnp.abs(values) / SOFTNESS + jax.random.gumbel(key, values.shape))


def judge(
    critics: Critics,
    observation: Float[AnyArray, "*batch observation"],
    values: Float[AnyArray, "*batch slot"],
    log_probs: Float[AnyArray, "*batch slot"],
) -> tuple[Float[AnyArray, "*batch"], Float[AnyArray, "*batch"]]:
    """What a slot that will be drawn is worth to the critics, which see pooled values, and its log-probability.

    Both are means over the slots with their chances: so the gradient reaches the value of each slot through its own
    pooled vector, and the choice through the chances. Through the largest alone no choice could be learned. The
    entropy is that of the drawn slot and its value (as in Delalleau et al. 2019): one that asked every value to be
    uncertain would make those large that no slot is meant for, and so draw their slots.
    """
    slots = values.shape[-1]
    pooled = values[..., None, :] * jnp.eye(slots)
    seen = jnp.broadcast_to(observation[..., None, :], (*values.shape, observation.shape[-1]))
    log_chance = jax.nn.log_softmax(jnp.abs(values) / SOFTNESS, axis=-1)
    chance = jnp.exp(log_chance)
    worth = jnp.sum(chance * critics(seen, pooled), axis=-1).min(0)
    return worth, jnp.sum(chance * (log_chance + log_probs), axis=-1)


def slot_sac(config: SACConfig, slots: int) -> SACConfig:
    """For so many slots: the wanted entropy is per number of an action, and of all values one is done."""
    return replace(config, target_entropy=config.target_entropy / slots)


def subgoal_of(pooled: Float[AnyArray, "*batch slot"], state: GlobalState, slots: Slots) -> Subgoal:
    """What a pooled vector asks for in this state: a goal is a point in the world that far ahead.

    It grows with the square of a value: a goal that is a hand's breadth ahead has a value that no other slot outdoes
    by chance, so a robot that has arrived can stand.
    """
    families, scales = map(jnp.asarray, zip(*slots, strict=True))
    family = families[jnp.argmax(jnp.abs(pooled), axis=-1)]
    value = jnp.sum(pooled * jnp.abs(pooled) * scales, axis=-1)
    return Subgoal(family, jnp.where(family == GOAL, state.x + value, value))


def _keep(values, strength):
    return values * jax.nn.one_hot(jnp.argmax(strength, axis=-1), values.shape[-1])
