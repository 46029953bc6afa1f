"""A reward law with parameters: what people pay for a distance, in any scale, with any bonus, late (docs/any-law.md).

    reward = offset - exp(log_scale) * h(distance of the state some time before, exponent, log_width)

Distances are in units of the encoder's scales. A kind of law says which h is meant and what is likely of its
parameters; data have the last word.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rebody.inference.decoder import Expert
from rebody.inference.inputs import apart
from rebody.types import AnyArray

LATEST = 3
"""Decisions that a reward may be late."""
PARAMETERS = 5
"""Offset, log-scale, exponent, log-width, delay: they stand before the amounts of an expert."""
OFFSET, LOG_SCALE, EXPONENT, LOG_WIDTH, DELAY = range(PARAMETERS)
FAR = 1.0
"""Standard deviation of places, in units of the encoder's scales."""
TINY = 1e-8
DELAYS = (0.3, 1.0, 2.0, 3.0)
"""Decisions that a hypothesis may begin at: from none, the squared error of late rewards has other minima."""
STEEP = 30.0
"""How sharp the corner of a clipped law is."""


class Kind(NamedTuple):
    """A kind of law, as numbers: kinds of many hypotheses are an array."""

    exponent: float | Float[AnyArray, "*batch"]
    exponent_std: float | Float[AnyArray, "*batch"]
    log_width: float | Float[AnyArray, "*batch"]
    log_width_std: float | Float[AnyArray, "*batch"]
    is_gaussian: float | Float[AnyArray, "*batch"]
    is_clipped: float | Float[AnyArray, "*batch"]
    is_l1: float | Float[AnyArray, "*batch"]
    log_chance: float | Float[AnyArray, "*batch"]


_HELD = 0.01
"""Standard deviation of what a kind does not have."""
DISTANCE = Kind(1.0, 0.15, 0.0, _HELD, 0.0, 0.0, 0.0, float(np.log(0.4)))
SQUARED = Kind(2.0, 0.25, 0.0, _HELD, 0.0, 0.0, 0.0, float(np.log(0.2)))
GAUSSIAN = Kind(2.0, 0.15, -0.5, 1.0, 1.0, 0.0, 0.0, float(np.log(0.2)))
CLIPPED = Kind(1.0, 0.15, -0.5, 1.0, 0.0, 1.0, 0.0, float(np.log(0.1)))
L1 = Kind(1.0, 0.15, 0.0, _HELD, 0.0, 0.0, 1.0, float(np.log(0.1)))


def kinds_of(expert: Expert) -> Kind:
    """Those that are worth a try, stacked: of one number all norms are the same."""
    kinds = [DISTANCE, SQUARED, GAUSSIAN, CLIPPED] + ([L1] if len(expert.fields) > 1 else [])
    return Kind(*(jnp.asarray(column, jnp.float32) for column in zip(*kinds, strict=True)))


def lost(distance: Float[AnyArray, "*batch"], kind: Kind, law: Float[AnyArray, " parameter"]) -> Float[Array, "*batch"]:
    """h: what a distance costs at a scale of 1."""
    far = (distance + TINY) ** jnp.clip(law[EXPONENT], 0.3, 4.0)
    width = jnp.exp(jnp.clip(law[LOG_WIDTH], -5.0, 3.0))
    # narrow Gaussians pay for what is near alone, wide ones are squares
    steep = width ** -jnp.clip(law[EXPONENT], 0.3, 4.0)
    saturated = jnp.expm1(-steep * far) / jnp.expm1(-steep)
    clipped = far - width / STEEP * jax.nn.softplus(STEEP * (far / width - 1))
    return jnp.where(kind.is_gaussian > 0, saturated, jnp.where(kind.is_clipped > 0, clipped, far))


class Late(NamedTuple):
    """States that rewards may have been paid in, as an expert reads them."""

    newest: Float[AnyArray, "heard own"]
    since: Float[AnyArray, "heard late own"]
    """How far those before lie from the newest; angles the shorter way round."""

    @classmethod
    def of(cls, expert: Expert, states: Float[AnyArray, "heard late own"]) -> "Late":
        """Of the states 0 to `LATEST` decisions before."""
        newest = states[:, 0]
        return cls(newest, apart(states, newest[:, None], expert.fields, expert.scales))


def rewards_by(
    expert: Expert, late: Late, kind: Kind, parameters: Float[AnyArray, " parameter"]
) -> Float[Array, " heard"]:
    """What is paid, between two decisions in a state between theirs; parameters are those of the law, then the expert's
    amounts."""
    law, amounts = parameters[:PARAMETERS], parameters[PARAMETERS:]
    share = jnp.maximum(1 - jnp.abs(jnp.arange(LATEST + 1) - law[DELAY]), 0.0)
    states = late.newest + jnp.einsum("l,hlo->ho", share, late.since)
    error = apart(states, expert.place(amounts), expert.fields, expert.scales)
    distance = jnp.sqrt(jnp.sum(error**2, axis=-1) + TINY)
    if len(expert.fields) > 1:
        distance = jnp.where(kind.is_l1 > 0, jnp.sum(jnp.abs(error), axis=-1), distance)
    return law[OFFSET] - jnp.exp(law[LOG_SCALE]) * lost(distance, kind, law)


class LawPrior(NamedTuple):
    """A Gaussian over all parameters of a hypothesis."""

    mean: Float[AnyArray, " parameter"]
    deviation: Float[AnyArray, " parameter"]


class Rewards(NamedTuple):
    """What rewards are like, before they are looked at one by one."""

    lowest: Float[AnyArray, ""]
    highest: Float[AnyArray, ""]
    spread: Float[AnyArray, ""]


def prior_of(expert: Expert, amounts: int, kind: Kind, rewards: Rewards) -> LawPrior:
    """What is likely of a law of that kind, and of a place.

    More can be had than was had so far: who took the best reward that was heard for the best there is would stop on a
    slope, wherever he is. Places are as far off as the encoder's scales.
    """
    span = rewards.highest - rewards.lowest + rewards.spread
    means = [rewards.highest + 0.5 * span, jnp.log(rewards.spread) + 0.5, kind.exponent, kind.log_width, 0.0]
    deviations = [span, 1.5, kind.exponent_std, kind.log_width_std, 0.7]
    weights = expert.reference.weights[0]
    far = FAR * jnp.sqrt(min(weights.shape)) / jnp.sqrt(jnp.sum(weights**2))
    return LawPrior(
        jnp.concatenate([jnp.stack(jnp.broadcast_arrays(*map(jnp.asarray, means))), jnp.zeros(amounts)]),
        jnp.concatenate([jnp.stack(jnp.broadcast_arrays(*map(jnp.asarray, deviations))), jnp.full(amounts, far)]),
    )


def begun(
    expert: Expert,
    late: Late,
    rewards: Float[AnyArray, " heard"],
    weights: Float[AnyArray, " heard"],
    kind: Kind,
    amounts: Float[AnyArray, " amount"],
    spread: Float[AnyArray, ""],
) -> Float[Array, " parameter"]:
    """A place with the law of that kind that suits it best: offset and scale by linear regression at each of `DELAYS`,
    of which the one with the smallest squared error is taken."""
    count = jnp.maximum(jnp.sum(weights), 1.0)
    mean_reward = jnp.sum(weights * rewards) / count

    def regressed(delay):
        law = jnp.stack([jnp.asarray(x, jnp.float32) for x in (0.0, 0.0, kind.exponent, kind.log_width, delay)])
        start = jnp.concatenate([law, amounts])
        paid = rewards_by(expert, late, kind, start)
        mean_paid = jnp.sum(weights * paid) / count
        covariance = jnp.sum(weights * (paid - mean_paid) * (rewards - mean_reward))
        variance = jnp.sum(weights * (paid - mean_paid) ** 2)
        scale = jnp.clip(covariance / (variance + TINY), 0.02 * spread, 1e3 * spread)
        offset = mean_reward - scale * mean_paid
        squared = jnp.sum(weights * (rewards - offset - scale * paid) ** 2)
        return start.at[OFFSET].set(offset).at[LOG_SCALE].set(jnp.log(scale)), squared

    starts, squared = jax.vmap(regressed)(jnp.asarray(DELAYS))
    return starts[jnp.argmin(squared)]
