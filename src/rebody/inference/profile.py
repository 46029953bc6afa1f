"""How well distances explain rewards by any law: scale and bonus by regression, noise integrated out.

What a module of any law learns by, in place of a reward's likelihood in known units.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.types import AnyArray

WIDTHS = (0.3, 1.0)
"""Of Gaussian laws, in units of the encoder's scales."""
EXACT = 0.03
"""Errors that count as none, as a share of the rewards' spread."""
TINY = 1e-8


def log_likelihoods(
    distance: Float[AnyArray, "*batch heard"],
    reward: Float[AnyArray, "*#batch heard"],
    weight: Float[AnyArray, "*#batch heard"],
) -> Float[Array, "*batch law"]:
    """Of a few laws, at the scale and bonus that suit each best, per reward [nats]; 0 where distances tell nothing."""
    paid = [-distance, -(distance**2)] + [jnp.exp(-((distance / width) ** 2)) for width in WIDTHS]
    total = jnp.sum(weight, axis=-1, keepdims=True) + TINY

    def about(values):
        return values - jnp.sum(weight * values, axis=-1, keepdims=True) / total

    off = about(reward)
    whole = jnp.sum(weight * off**2, axis=-1) + TINY
    unlikely = []
    for law in map(about, paid):
        alone = jnp.sum(weight * law**2, axis=-1) + TINY
        scale = jnp.maximum(jnp.sum(weight * law * off, axis=-1) / alone, 0.0)  # nobody is paid for being farther away
        left = jnp.sum(weight * (off - scale[..., None] * law) ** 2, axis=-1)
        unlikely.append(0.5 * jnp.log(left / whole + EXACT**2))
    return -jnp.stack(unlikely, axis=-1)
