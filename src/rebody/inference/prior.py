"""Priors over the latent: a function (mean, variance) -> KL divergence, passed to the loss (thesis 5.6)."""

from typing import Protocol, runtime_checkable

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.types import AnyArray, Belief


@runtime_checkable  # so that annotations can be checked
class Prior(Protocol):
    """KL(q(z) || p(z)) of each belief [nats]."""

    def __call__(self, belief: Belief) -> Float[AnyArray, "*batch"]:
        """KL of each belief [nats]."""
        ...


class SplitPrior(eqx.Module):
    """One prior for the dimensions that say what kind of task it is, N(0, I) for those that say how much."""

    kinds: Prior
    dimensions: int = eqx.field(static=True)
    """How many say what kind it is."""
    weight: float = eqx.field(static=True)
    """Of their divergence, relative to that of the others."""

    def __call__(self, belief: Belief) -> Float[AnyArray, "*batch"]:
        """The weighted sum of both [nats]."""
        kind, amount = split(belief, self.dimensions)
        return self.weight * self.kinds(kind) + unit_gaussian(amount)


def split(belief: Belief, dimensions: int) -> tuple[Belief, Belief]:
    """What kind of task it is, and how much of it."""
    kind = Belief(belief.mean[..., :dimensions], belief.variance[..., :dimensions])
    return kind, Belief(belief.mean[..., dimensions:], belief.variance[..., dimensions:])


def unit_gaussian(belief: Belief) -> Float[AnyArray, "*batch"]:
    """KL to N(0, I)."""
    variance = belief.variance
    return 0.5 * jnp.sum(variance + belief.mean**2 - 1.0 - jnp.log(variance), axis=-1)
