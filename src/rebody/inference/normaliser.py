"""Rewards in units of what was heard shortly before, for an encoder that hears any scale and any bonus."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.types import AnyArray

KEEPS = 0.97
"""Share of the weight of rewards that stays at the next one: they count for 3 s."""
LARGEST = 5.0
"""No reward lies farther from the mean, in standard deviations."""
SMALLEST = 1e-5


class Normaliser(eqx.Module):
    """Running moments of the rewards of bodies."""

    weight: Float[AnyArray, "*batch"]
    mean: Float[AnyArray, "*batch"]
    variance: Float[AnyArray, "*batch"]

    def hearing(self, reward: Float[AnyArray, "*batch"]) -> "Normaliser":
        """After one more reward."""
        weight = KEEPS * self.weight + 1
        off = reward - self.mean
        mean = self.mean + off / weight
        variance = (1 - 1 / weight) * self.variance + off * (reward - mean) / weight
        return Normaliser(weight, mean, variance)

    def __call__(self, reward: Float[AnyArray, "*batch"]) -> Float[Array, "*batch"]:
        """A reward in standard deviations from the mean."""
        spread = jnp.sqrt(self.variance) + 1e-3 * jnp.abs(self.mean) + SMALLEST
        return jnp.clip((reward - self.mean) / spread, -LARGEST, LARGEST)


def no_moments(shape: tuple[int, ...]) -> Normaliser:
    """Nothing heard yet."""
    return Normaliser(jnp.zeros(shape), jnp.zeros(shape), jnp.zeros(shape))


def normalised(rewards: Float[AnyArray, "*batch time"]) -> Float[Array, "*batch time"]:
    """Each reward of episodes as it was heard then."""

    def hear(moments, reward):
        moments = moments.hearing(reward)
        return moments, moments(reward)

    _, heard = jax.lax.scan(hear, no_moments(rewards.shape[:-1]), jnp.moveaxis(jnp.asarray(rewards), -1, 0))
    return jnp.moveaxis(heard, 0, -1)
