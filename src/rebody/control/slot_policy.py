"""A high-level policy that was learned on a robot (thesis 5.6.2, 6.5): a value per slot, the largest is the subgoal."""

from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PRNGKeyArray

from rebody.control.high_level import PolicyView
from rebody.control.places import UNBOUNDED, Place, Places, lengths, owners, split_places
from rebody.control.sac import Actor, Critics, SACConfig
from rebody.tasks.family_set import FamilySet, fit
from rebody.tasks.quantities import length
from rebody.types import AnyArray, Belief, GlobalState, Subgoal

SOFTNESS = 0.1
"""While it learns, a slot is drawn by a softmax of |value| over this; at test time the argmax is used."""


class SlotPolicy(eqx.Module):
    """(global state, belief) -> subgoal."""

    actor: Actor
    view: PolicyView = eqx.field(static=True)
    slots: Places = eqx.field(static=True)
    """Of each family of the module, what a value of 1 asks for [m ahead of the robot, m/s, rad]."""

    def __call__(self, state: GlobalState, belief: Belief) -> Subgoal:
        """The subgoal of the largest |value|."""
        return subgoal_of(pool(self.actor(self.view(state, belief)), self.slots), state, self.slots)


def slots_within(families: FamilySet, commands: FamilySet) -> Places:
    """A slot for each family, its scale the largest that may be asked of the tracker."""
    return tuple(Place(each.quantity, commands.named(each.name).range.largest) for each in families)


def pool(values: Float[AnyArray, "*batch number"], slots: Places) -> Float[AnyArray, "*batch number"]:
    """The largest |value| as it is, zero in all other slots."""
    return _keep(values, lengths(slots, values), slots)


def draw(
    values: Float[AnyArray, "*batch number"], slots: Places, key: PRNGKeyArray
) -> Float[AnyArray, "*batch number"]:
    """Pooled, but the slot drawn by a softmax of |value|."""
    strength = lengths(slots, values)
    return _keep(values, strength / SOFTNESS + jax.random.gumbel(key, strength.shape), slots)


@dataclass(frozen=True)
class SlotValue:
    """The action value of a slot that will be drawn (`sac.ActionValue`)."""

    slots: Places

    def __call__(
        self,
        critics: Critics,
        observation: Float[AnyArray, "*batch observation"],
        values: Float[AnyArray, "*batch number"],
        log_probs: Float[AnyArray, "*batch number"],
    ) -> tuple[Float[AnyArray, "*batch"], Float[AnyArray, "*batch"]]:
        """What it is worth to the critics, which see pooled values, and its log-probability.

        Both are means over the slots with their chances: so the gradient reaches the value of each slot through its own
        pooled vector, and the choice through the chances. Through the largest alone no choice could be learned. The
        entropy is that of the drawn slot and its value (as in Delalleau et al. 2019): one that asked every value to be
        uncertain would make those large that no slot is meant for, and so draw their slots.
        """
        is_own = np.arange(len(self.slots))[:, None] == owners(self.slots)
        pooled = values[..., None, :] * is_own
        seen = jnp.broadcast_to(observation[..., None, :], (*pooled.shape[:-1], observation.shape[-1]))
        log_chance = jax.nn.log_softmax(lengths(self.slots, values) / SOFTNESS, axis=-1)
        chance = jnp.exp(log_chance)
        worth = jnp.sum(chance * critics(seen, pooled), axis=-1).min(0)
        of_slot = jnp.sum(log_probs[..., None, :] * is_own, axis=-1)
        return worth, jnp.sum(chance * (log_chance + of_slot), axis=-1)


def slot_sac(config: SACConfig, slots: int) -> SACConfig:
    """For so many slots: the wanted entropy is per number of an action, and of all slots one is done."""
    return replace(config, target_entropy=config.target_entropy / slots)


def subgoal_of(pooled: Float[AnyArray, "*batch number"], state: GlobalState, slots: Places) -> Subgoal:
    """What a pooled vector asks for in this state: a place is a point in the world that far ahead.

    It grows with the square of a value: a goal that is a hand's breadth ahead has a value that no other slot outdoes
    by chance, so a robot that has arrived can stand.
    """
    slot, size = jnp.argmax(lengths(slots, pooled), axis=-1), max(place.size for place in slots)
    own = zip(slots, split_places(slots, pooled), strict=True)
    of_each = jnp.stack([fit(_asked(place, values, state), size) for place, values in own], axis=-2)
    return Subgoal(slot, jnp.take_along_axis(of_each, slot[..., None, None], axis=-2)[..., 0, :])


def _asked(place: Place, values, state: GlobalState) -> Float[AnyArray, "*batch size"]:
    from_here = np.array([name in UNBOUNDED for name in place.quantity.components], np.float32)
    asked = values * length(values)[..., None] * jnp.asarray(place.scales)
    return asked + from_here * place.quantity.read(state)


def _keep(values, strength, slots: Places):
    kept = jax.nn.one_hot(jnp.argmax(strength, axis=-1), len(slots))
    return values * kept[..., owners(slots)]
