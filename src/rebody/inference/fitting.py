"""The likeliest parameters of one expert and one kind of law, by what was heard; the noise is fitted with them.

Rewards may be paid with costs that the task does not know, so nobody says how exact they are: their standard deviation
is integrated out, which leaves the logarithm of the squared errors (Student's distribution).
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int, Num

from rebody.inference.decoder import Expert
from rebody.inference.law import DELAY, LATEST, PARAMETERS, Kind, Late, LawPrior, rewards_by
from rebody.inference.roots import log_determinant, root_of, solved
from rebody.types import AnyArray

STEPS = 5
"""Of Gauss and Newton at a decision; hypotheses go on from where they were."""
EXACT, COUNTS = 1e-3, 1.0
"""Standard deviation of rewards that is expected, as a share of their spread, and how many entries that counts as."""
FIRST_DAMPING, LESS, MORE, RIDGE = 1e-2, 0.2, 8.0, 1e-6


class Evidence(NamedTuple):
    """What is to be explained: rewards, each the mean of `weights` of them, and the states that an expert reads."""

    states: Late
    rewards: Float[AnyArray, " heard"]
    weights: Float[AnyArray, " heard"]
    spread: Float[AnyArray, ""]


class Fit(NamedTuple):
    """Where a fit ended."""

    parameters: Float[AnyArray, "*batch parameter"]
    """Of the law, then the amounts."""
    cost: Float[AnyArray, "*batch"]
    """Minus the logarithm of the evidence by Laplace's approximation, but for a constant [nats]."""
    root: Float[AnyArray, "*batch amount amount"]
    """Root of the inverse covariance of the amounts, whatever the law is (`root_of`)."""
    noise: Float[AnyArray, "*batch"]
    """Standard deviation of the rewards about it, in their unit."""


def share_explained(
    noise: Float[AnyArray, "*batch"],
    variance: Float[AnyArray, "*#batch"],
    rewards: Num[AnyArray, "*#batch"],
    free: Int[AnyArray, "*#batch"] | int,
) -> Float[Array, "*batch"]:
    """Share of a variance that is explained where so much noise is left, in [0, 1].

    So many free parameters explain some of any rewards, which is taken off (the adjusted R^2 of Ezekiel 1930); 0 where
    there are no more rewards than parameters.
    """
    spare = rewards - free
    share = 1 - noise**2 / variance * (rewards - 1) / jnp.maximum(spare, 1)
    return jnp.where(spare > 0, jnp.clip(share, 0.0, 1.0), 0.0)


def fit(
    expert: Expert,
    evidence: Evidence,
    kind: Kind,
    prior: LawPrior,
    start: Float[AnyArray, " parameter"],
    steps: int = STEPS,
) -> Fit:
    """Damped Gauss-Newton steps from a start, never anywhere worse."""
    floor = COUNTS * (EXACT * evidence.spread) ** 2
    # an entry is a mean of `weights` rewards: one squared error, of a variance that is smaller by as much
    count, weigh = jnp.sum(evidence.weights > 0) + COUNTS, jnp.sqrt(evidence.weights)

    def errors(parameters):
        return weigh * (evidence.rewards - rewards_by(expert, evidence.states, kind, parameters))

    def squared(parameters):
        return jnp.sum(errors(parameters) ** 2) + floor

    def unlikely(parameters):
        off = (parameters - prior.mean) / prior.deviation
        return 0.5 * count * jnp.log(squared(parameters) / floor) + 0.5 * jnp.sum(off**2)

    def slopes(parameters):
        noise = jnp.sqrt(squared(parameters) / count)
        return -jax.jacfwd(errors)(parameters) / noise, noise

    def step(walk, _):
        parameters, cost, damping = walk
        slope, noise = slopes(parameters)
        damped = jnp.diag(jnp.sqrt(damping * (jnp.sum(slope**2, axis=0) + prior.deviation**-2) + RIDGE))
        uphill = slope.T @ (errors(parameters) / noise) - (parameters - prior.mean) / prior.deviation**2
        new = parameters + solved(root_of(slope, jnp.diag(1 / prior.deviation), damped), uphill)
        new = new.at[DELAY].set(jnp.clip(new[DELAY], 0.0, LATEST))
        new_cost = unlikely(new)
        helped = new_cost < cost
        ended = jnp.where(helped, new, parameters), jnp.where(helped, new_cost, cost)
        return (*ended, damping * jnp.where(helped, LESS, MORE)), None

    begun = (start, unlikely(start), jnp.asarray(FIRST_DAMPING))
    (parameters, cost, _), _ = jax.lax.scan(step, begun, length=steps)
    slope, noise = slopes(parameters)
    root = root_of(slope, jnp.diag(1 / prior.deviation))
    volume = -0.5 * log_determinant(root) - jnp.sum(jnp.log(prior.deviation))
    cost = cost - volume - kind.log_chance
    # a triangular root: its last block is that of the amounts, the law integrated out
    return Fit(parameters, jnp.where(jnp.isfinite(cost), cost, jnp.inf), root[PARAMETERS:, PARAMETERS:], noise)
