"""Damped Gauss-Newton steps on what a reward expert leaves unexplained (docs/sharp-beliefs.md).

The expert is a likelihood with a handful of parameters, its amounts; all here is about one expert and one body.
"""

from collections.abc import Callable
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rebody.inference.decoder import Expert
from rebody.inference.roots import root_of, solved
from rebody.types import AnyArray

STEPS = 6
"""Of each refinement: a guess that is near has arrived by then."""
FLOOR, RELATIVE = 2e-3, 0.01
"""Standard deviation of the decoder's error: so much of the reward scale, and such a share of the reward, since what
is not learned exactly is the weight of a distance."""
ASSUMED = 1e-3
"""How many rewards that error counts as, when it is estimated by what is left: a decoder may be far better, and rewards
may be noisy."""
RIDGE = 1e-6
FIRST_DAMPING, LESS, MORE = 1e-2, 0.2, 8.0
"""Of Levenberg and Marquardt: at the start, after a step that helped, and after one that did not."""


class Heard(eqx.Module):
    """What one expert is to explain: rewards and the states that they were paid in, in the encoder's units."""

    expert: Expert
    states: Float[AnyArray, "window own"]
    rewards: Float[AnyArray, " window"]
    is_heard: Bool[AnyArray, " window"]
    """False for what belongs to another task, or was before the episode began."""


class Known(NamedTuple):
    """What is known of the amounts beside that: half of the square of `root @ amount - aim`, and a weak Gaussian around
    `guess`."""

    root: Float[AnyArray, "amount amount"]
    """Root of an inverse covariance (`root_of`)."""
    aim: Float[AnyArray, " amount"]
    guess: Float[AnyArray, " amount"]
    precision: Float[AnyArray, " amount"]
    """One over the standard deviation."""


class Refined(NamedTuple):
    """Where a refinement ended."""

    amount: Float[AnyArray, "*batch amount"]
    cost: Float[AnyArray, "*batch"]
    """Negative log-likelihood there, but for a constant [nats]."""
    root: Float[AnyArray, "*batch amount amount"]
    """Root of the inverse covariance there (`root_of`)."""
    honest: Float[AnyArray, "*batch amount amount"]
    """The same by the errors that are left, not by those that are assumed; beside a unit Gaussian (thesis 5.6)."""


def surprise(
    expert: Expert,
    state: Float[AnyArray, "*#batch own"],
    reward: Float[AnyArray, "*#batch"],
    amount: Float[AnyArray, "*#batch amount"],
) -> Float[AnyArray, "*#batch"]:
    """Distance of rewards from what is expected, in standard deviations of the decoder's error."""
    return (reward - expert(state, amount)) / (FLOOR + RELATIVE * jnp.abs(reward))


def refine(heard: Heard, start: Float[AnyArray, " amount"], known: Known, steps: int = STEPS) -> Refined:
    """Levenberg-Marquardt from a start, a fixed number of steps; it never ends anywhere worse."""

    size = start.shape[-1]

    def unexplained(amount):
        window = jnp.where(heard.is_heard, surprise(heard.expert, heard.states, heard.rewards, amount[None]), 0.0)
        return jnp.concatenate([window, known.root @ amount - known.aim, known.precision * (amount - known.guess)])

    amount, cost, slope = levenberg_marquardt(unexplained, start, steps)
    window = len(heard.rewards)
    rows = jnp.arange(len(slope)) < window + size
    noise = jnp.where(rows, _noise(unexplained(amount)[:window], jnp.sum(heard.is_heard) - size), 1.0)
    return Refined(amount, cost, root_of(slope), root_of(slope / noise[:, None], jnp.eye(size)))


def _noise(left: Float[Array, " window"], freedom: Int[Array, ""]) -> Float[Array, ""]:
    """Standard deviation of the errors, in units of the assumed one, which counts as `ASSUMED` of a reward."""
    return jnp.sqrt((ASSUMED + jnp.sum(left**2)) / (ASSUMED + jnp.maximum(freedom, 0)))


def levenberg_marquardt(
    unexplained: Callable[[Float[Array, " amount"]], Float[Array, " error"]],
    start: Float[AnyArray, " amount"],
    steps: int,
    within: Callable[[Float[Array, " amount"]], Float[Array, " amount"]] = lambda amount: amount,
) -> tuple[Float[Array, " amount"], Float[Array, ""], Float[Array, "error amount"]]:
    """Where so many steps down half of the squared errors end, never anywhere worse; what is left of it there, and the
    errors' slope. `within` brings amounts back into their range.
    """

    def cost_of(amount):
        return 0.5 * jnp.sum(unexplained(amount) ** 2)

    def step(walk, _):
        amount, cost, damping = walk
        error, slope = unexplained(amount), jax.jacfwd(unexplained)(amount)
        damped = jnp.diag(jnp.sqrt(damping * jnp.sum(slope**2, axis=0) + RIDGE))
        new = within(amount - solved(root_of(slope, damped), slope.T @ error))
        new_cost = cost_of(new)
        helped = new_cost < cost
        ended = jnp.where(helped, new, amount), jnp.where(helped, new_cost, cost)
        return (*ended, damping * jnp.where(helped, LESS, MORE)), None

    start = jnp.asarray(start)
    begun = (start, cost_of(start), jnp.asarray(FIRST_DAMPING))
    (amount, cost, _), _ = jax.lax.scan(step, begun, length=steps)
    return amount, cost, jax.jacfwd(unexplained)(amount)
