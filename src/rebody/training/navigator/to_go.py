"""What a subgoal will still cost at the end of a course that is too short to turn round and walk.

Whoever sees 2.4 s ahead walks backwards to a place behind it, be it ever so slow. This says that turning pays.
"""

import jax.numpy as jnp
from jaxtyping import Float

from rebody.bodies.walking.toy import Walker
from rebody.types import AnyArray

SLOWEST = 0.05
"""Taken for the speed of a way that a robot does not go [m/s, rad/s]."""
LASTS_S = 10.0
"""How long a velocity is wanted for [s]."""


def time_to_go(walker: Walker, place: Float[AnyArray, "*batch 2"]) -> Float[AnyArray, "*batch"]:
    """Until it reaches a place ahead and to the left of it [m]: as it stands or turned towards it first, whichever is
    sooner [s]."""
    ahead, left = jnp.moveaxis(place, -1, 0)
    forward, sideways, turn = _fastest(walker, ahead, left)
    as_it_stands = jnp.abs(ahead) / forward + jnp.abs(left) / sideways  # one way after the other
    straight = _fastest(walker, jnp.ones_like(ahead), left)[0]
    distance = jnp.sqrt(ahead**2 + left**2 + 1e-6)
    turned_first = jnp.abs(jnp.arctan2(left, ahead)) / turn + distance / straight
    return jnp.minimum(as_it_stands, turned_first)


def error_to_go(walker: Walker, velocity: Float[AnyArray, "*batch 2"]) -> Float[AnyArray, "*batch"]:
    """What a velocity ahead and to the left [m/s] will be missed by, over time [m]: for `LASTS_S` by as much as the
    robot cannot go as it stands, or by all of it until it has turned that way, whichever is less."""
    ahead, left = jnp.moveaxis(velocity, -1, 0)
    forward, sideways, turn = _fastest(walker, ahead, left)
    shares = jnp.stack([jnp.abs(ahead) / forward, jnp.abs(left) / sideways])
    share = jnp.maximum(shares.max(axis=0), shares.sum(axis=0) / walker.measured.at_once[..., 0])
    speed = jnp.sqrt(ahead**2 + left**2 + 1e-6)
    as_it_stands = LASTS_S * speed * (1 - 1 / jnp.maximum(share, 1.0))
    return jnp.minimum(as_it_stands, speed * jnp.abs(jnp.arctan2(left, ahead)) / turn)


def _fastest(walker: Walker, ahead: Float[AnyArray, "*batch"], left: Float[AnyArray, "*batch"]):
    """Speeds of the three ways towards that side, of turns the mean of both [m/s, rad/s]."""
    robot = walker.measured
    sides = jnp.stack([ahead, left, left], axis=-1) > 0
    ends = walker.gain * jnp.where(sides, robot.high, -robot.low) + jnp.where(sides, 1, -1) * robot.drift
    ends = ends.at[..., 2].set(0.5 * (walker.gain * (robot.high - robot.low))[..., 2])
    return tuple(jnp.moveaxis(jnp.maximum(ends, SLOWEST), -1, 0))
