"""How sure a belief is of the target that is read from it, as a covariance: an ellipse where that is a place.

The variances of a sharpened belief go to a policy that learned by the encoder's, so they are never larger than those.
What is really known of a target is what the rewards that were heard say of it.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.inference.decoder import Expert
from rebody.inference.probe import Probe
from rebody.inference.reader import PlaceReader
from rebody.inference.refine import surprise
from rebody.inference.sharpened import Memory, Sharpened
from rebody.types import AnyArray, Belief

ANYWHERE = 5.0
"""Standard deviation of amounts before anything is heard: that of targets all over the range, and more."""


@eqx.filter_jit
def believed_covariances(reader: Probe | PlaceReader, belief: Belief) -> list[Float[Array, "size size"]]:
    """Of each family's target, were it the one, in the units of its quantity: as the belief [latent] itself says."""
    slopes = jax.jacobian(lambda mean: [target for target, _ in reader.spreads(Belief(mean, belief.variance))])
    return [(slope * belief.variance) @ slope.T for slope in slopes(jnp.asarray(belief.mean))]


@eqx.filter_jit
def heard_covariances(inferrer: Sharpened, memory: Memory) -> list[Float[Array, "size size"]]:
    """The same by all that was heard: Laplace's approximation around the likeliest hypothesis of each family."""
    window = memory.states.shape[-2]
    is_heard = jnp.arange(window) >= window - memory.heard
    covariances = []
    for expert, hypotheses in zip(inferrer.decoder.experts, memory.experts, strict=True):
        states, amounts = inferrer.decoder.read(expert, memory.states), hypotheses.amounts[0]
        errors = jax.jacobian(lambda a, on=expert, at=states: surprise(on, at, memory.rewards, a[None]))(amounts)
        spread = _inverse_root(jnp.where(is_heard[:, None], errors, 0.0), hypotheses.information[0])
        slopes = _scaled_slopes(expert, amounts) @ spread
        covariances.append(slopes @ slopes.T)
    return covariances


def _inverse_root(
    errors: Float[AnyArray, "window amount"], past: Float[AnyArray, "amount amount"]
) -> Float[Array, "amount amount"]:
    """A root of the covariance. The window's slopes are never squared: float32 would lose what is hardly known."""
    values, vectors = jnp.linalg.eigh(past)
    rows = [errors, jnp.sqrt(jnp.maximum(values, 0.0))[:, None] * vectors.T, jnp.eye(len(past)) / ANYWHERE]
    _, sizes, directions = jnp.linalg.svd(jnp.concatenate(rows), full_matrices=False)
    return directions.T / sizes


def _scaled_slopes(expert: Expert, amounts: Float[AnyArray, " amount"]) -> Float[Array, "size amount"]:
    """Of the place that an expert means, in its units [m, rad, m/s]."""
    return jax.jacobian(expert.place)(amounts) * jnp.asarray(expert.scales)[:, None]
