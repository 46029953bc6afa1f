"""What was heard since the task began, in a buffer of fixed size: neighbours that say the same become one.

Neighbours in time are merged by Ward's criterion (1963): a body that stands at its goal repeats itself, and what was
learned on the way there stays for ever. The newer state stays; its reward becomes the mean of both, less what the
likeliest hypothesis says lies between the states. So noise is averaged, and exact rewards stay exact.
"""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from rebody.inference.inputs import apart
from rebody.types import AnyArray

HEARD = 40
"""Rewards that are kept."""
FINE = 3.0
"""How much more a difference of states counts than one of rewards, both in their units."""
SMALLEST = 1e-5
"""Least spread of rewards, in their unit; and a thousandth of their size."""


class Thinned(eqx.Module):
    """Rewards with the states that they may have been paid in; the newest last, behind it nothing."""

    states: Float[AnyArray, "*batch heard late field"]
    """Of each reward the state then, and those of the decisions before."""
    rewards: Float[AnyArray, "*batch heard"]
    weights: Float[AnyArray, "*batch heard"]
    """How many rewards each is the mean of; 0 for none."""
    recent: Float[AnyArray, "*batch late field"]
    """The last states, the newest first, heard in or not."""
    has_seen: Bool[AnyArray, "*batch"]
    moments: Float[AnyArray, "*batch 3"]
    """How many rewards there were, their mean, and their summed squared distance from it (Welford 1962)."""

    @property
    def spread(self) -> Float[Array, "*batch"]:
        """Their standard deviation, never 0."""
        count, mean, squared = (self.moments[..., i] for i in range(3))
        return jnp.maximum(jnp.sqrt(squared / jnp.maximum(count, 1)), 1e-3 * jnp.abs(mean) + SMALLEST)

    @property
    def heard(self) -> Float[Array, "*batch"]:
        """How many rewards the entries stand for: all since the task became another one."""
        return jnp.sum(self.weights, axis=-1)

    @property
    def variance(self) -> Float[Array, "*batch"]:
        """Of one reward about the mean of all, as far as means of some tell; never 0."""
        mean = jnp.sum(self.weights * self.rewards, axis=-1) / jnp.maximum(self.heard, 1.0)
        entries = jnp.maximum(jnp.sum(self.weights > 0, axis=-1), 1)
        squared = jnp.sum(self.weights * (self.rewards - mean[..., None]) ** 2, axis=-1) / entries
        return jnp.maximum(squared, (1e-3 * jnp.abs(mean) + SMALLEST) ** 2)

    @property
    def ends(self) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
        """The lowest and the highest reward that is kept."""
        there = self.weights > 0
        lowest = jnp.min(jnp.where(there, self.rewards, jnp.inf), axis=-1)
        return lowest, jnp.max(jnp.where(there, self.rewards, -jnp.inf), axis=-1)

    def seeing(self, state: Float[AnyArray, " field"]) -> "Thinned":
        """Of one body: after one more state. Before the first it was there all the time."""
        before = jnp.where(self.has_seen, self.recent, state)
        recent = jnp.concatenate([state[None], before[:-1]])
        return eqx.tree_at(lambda t: (t.recent, t.has_seen), self, (recent, jnp.ones_like(self.has_seen)))

    def hearing(
        self,
        reward: Float[AnyArray, ""],
        expected: Float[AnyArray, " heard"],
        fields: tuple[str, ...],
        scales: tuple[float, ...],
    ) -> "Thinned":
        """Of one body: after one more reward, paid in the newest state or shortly before.

        `expected` is what the likeliest hypothesis says of the rewards that are kept.
        """
        moments = _moments(self.moments, reward)
        now = eqx.tree_at(lambda t: t.moments, self, moments)
        kept, rewards, weights, last = now._room(expected, fields, scales)
        return Thinned(
            jnp.asarray(self.states)[kept].at[last].set(self.recent),
            rewards.at[last].set(reward),
            weights.at[last].set(1.0),
            self.recent,
            self.has_seen,
            moments,
        )

    def _room(self, expected, fields, scales):
        """Which entries stay, their rewards and weights then, and where a new one goes."""
        is_full, places = self.weights[-1] > 0, jnp.arange(len(self.weights))
        states, rewards = self.states[:, 0], self.rewards / self.spread
        off = jnp.sum((FINE * apart(states[1:], states[:-1], fields, scales)) ** 2, axis=-1)
        off = off + (rewards[1:] - rewards[:-1]) ** 2
        first, then = self.weights[:-1], self.weights[1:]
        least = jnp.argmin(off * first * then / jnp.maximum(first + then, 1.0))
        merged = jnp.asarray(self.weights).at[least + 1].add(self.weights[least])
        left = self.rewards - expected
        mean = (first * left[:-1] + then * left[1:]) / jnp.maximum(first + then, 1.0)
        averaged = jnp.asarray(self.rewards).at[least + 1].set((expected[1:] + mean)[least])
        kept = jnp.where(is_full, jnp.minimum(places + (places >= least), len(places) - 1), places)
        rewards = jnp.where(is_full, averaged[kept], self.rewards)
        weights = jnp.where(is_full, merged[kept], self.weights)
        return kept, rewards, weights, jnp.where(is_full, len(places) - 1, jnp.sum(self.weights > 0))

    def forgetting(self, forget: Bool[AnyArray, ""], but: int) -> "Thinned":
        """Of one body: with the newest few rewards alone, where all others are to be forgotten."""
        last = jnp.sum(self.weights > 0)
        kept = jnp.minimum(jnp.arange(len(self.weights)) + jnp.maximum(last - but, 0), len(self.weights) - 1)
        few = jnp.where(jnp.arange(len(self.weights)) < jnp.minimum(but, last), 1.0, 0.0)
        weights = jnp.where(forget, few, self.weights)
        states, rewards = (jnp.where(forget, each[kept], each) for each in (self.states, self.rewards))
        return eqx.tree_at(lambda t: (t.states, t.rewards, t.weights), self, (states, rewards, weights))


def nothing_heard(shape: tuple[int, ...], late: int, fields: int) -> Thinned:
    """Before the first state."""
    return Thinned(
        jnp.zeros((*shape, HEARD, late, fields)),
        jnp.zeros((*shape, HEARD)),
        jnp.zeros((*shape, HEARD)),
        jnp.zeros((*shape, late, fields)),
        jnp.zeros(shape, bool),
        jnp.zeros((*shape, 3)),
    )


def _moments(moments: Float[AnyArray, " 3"], reward: Float[AnyArray, ""]) -> Float[Array, " 3"]:
    count, mean, squared = moments
    off = reward - mean
    mean = mean + off / (count + 1)
    return jnp.stack([count + 1, mean, squared + off * (reward - mean)])
