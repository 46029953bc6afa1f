"""Priors over the latent: a function (mean, variance) -> KL divergence, passed to the loss (thesis 5.6)."""

from typing import Protocol, runtime_checkable

import jax.numpy as jnp
from jaxtyping import Float

from rebody.types import AnyArray, Belief


@runtime_checkable  # so that annotations can be checked
class Prior(Protocol):
    """KL(q(z) || p(z)) of each belief [nats]."""

    def __call__(self, belief: Belief) -> Float[AnyArray, "*batch"]:
        """KL of each belief [nats]."""
        ...


def unit_gaussian(belief: Belief) -> Float[AnyArray, "*batch"]:
    """KL to N(0, I)."""
    variance = belief.variance
    return 0.5 * jnp.sum(variance + belief.mean**2 - 1.0 - jnp.log(variance), axis=-1)
