"""Joystick commands that a walking policy learns from: all ways at once, one alone, slow ones, none."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.ranges import Box, Share
from rebody.types import AnyArray

SLOW = 0.3
"""Slow commands are up to this share of the limits."""


@dataclass(frozen=True)
class CommandDistribution:
    """How commands are drawn."""

    ways: tuple[Share, Share, Share] = (0.8, 0.5, 0.6)
    """How often a command goes forward or back, sideways, and turns."""
    spin_share: Share = 0.15
    """Share of commands that ask for a turn alone."""
    slow_share: Share = 0.2
    """Share of commands that are slow."""
    zero_share: Share = 0.1
    """Share of commands that ask to stand still."""

    def sample(self, key: PRNGKeyArray, size: int, limits: Box) -> Float[AnyArray, "size 3"]:
        """So many, within these limits [m/s, m/s, rad/s]."""
        value, way, spin, slow, pace, still = jax.random.split(key, 6)
        drawn = jax.random.uniform(value, (size, 3), minval=jnp.asarray(limits.low), maxval=jnp.asarray(limits.high))
        is_spin = jax.random.bernoulli(spin, self.spin_share, (size, 1))
        goes = jax.random.bernoulli(way, jnp.asarray(self.ways), (size, 3))
        drawn = drawn * jnp.where(is_spin, jnp.array([False, False, True]), goes)
        share = jnp.where(
            jax.random.bernoulli(slow, self.slow_share, (size, 1)), SLOW * jax.random.uniform(pace, (size, 1)), 1.0
        )
        return drawn * share * ~jax.random.bernoulli(still, self.zero_share, (size, 1))
