"""How sure a belief is of the target that is read from it, as a covariance: an ellipse where that is a place.

A belief has variances alone. What is really known of a target is what the rewards that were heard say of it.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.inference.any_law import LawMemory, SharpenedByAnyLaw
from rebody.inference.decoder import Expert
from rebody.inference.probe import Probe
from rebody.inference.reader import PlaceReader
from rebody.inference.sharpened import Memory, Sharpened
from rebody.types import AnyArray, Belief


@eqx.filter_jit
def believed_covariances(reader: Probe | PlaceReader, belief: Belief) -> list[Float[Array, "size size"]]:
    """Of each family's target, were it the one, in the units of its quantity: as the belief [latent] itself says."""
    slopes = jax.jacobian(lambda mean: [target for target, _ in reader.spreads(Belief(mean, belief.variance))])
    return [(slope * belief.variance) @ slope.T for slope in slopes(jnp.asarray(belief.mean))]


@eqx.filter_jit
def heard_covariances(
    inferrer: Sharpened | SharpenedByAnyLaw, memory: Memory | LawMemory
) -> list[Float[Array, "size size"]]:
    """The same by all that was heard: Laplace's approximation around the likeliest hypothesis of each family, by the
    errors that are left."""
    covariances = []
    for expert, hypotheses in zip(inferrer.decoder.experts, memory.experts, strict=True):
        slopes = _scaled_slopes(expert, hypotheses.amounts[0])
        half = jax.scipy.linalg.solve_triangular(hypotheses.honest[0], slopes.T, trans="T")
        covariances.append(half.T @ half)
    return covariances


def _scaled_slopes(expert: Expert, amounts: Float[AnyArray, " amount"]) -> Float[Array, "size amount"]:
    """Of the place that an expert means, in its units [m, rad, m/s]."""
    return jax.jacobian(expert.place)(amounts) * jnp.asarray(expert.scales)[:, None]
