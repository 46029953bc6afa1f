"""What is believed of one expert's amounts: a few hypotheses, carried from decision to decision."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from rebody.inference.decoder import Expert
from rebody.inference.inputs import CIRCULAR, apart, seen
from rebody.inference.refine import Heard, Known, Refined, refine, surprise
from rebody.inference.roots import log_determinant, root_of, variance_along
from rebody.types import AnyArray, Belief

KEPT = 2
"""Hypotheses of an expert: a straight walk leaves a place and its mirror image."""
APART = 3.0
"""Standard deviations between two hypotheses that are not one and the same."""
HOPELESS = 20.0
"""A hypothesis that is so much less likely than the best does not count [nats]."""
STARTS, TRIED = 8, 1
"""All over the places that an expert may mean, and how many of them are tried at each decision."""
GUESS_DEVIATIONS = 100.0
"""The guess is a prior of so many of its standard deviations: early in an episode the encoder is far too sure."""
LEAST, TINY, SCALED = 1e-14, 1e-20, 8
"""Least variance of an amount, and how often they are scaled."""
FADING = 0.998
"""Of what left the window, at each decision."""


class Hypotheses(eqx.Module):
    """Amounts that explain what was heard, the most likely first."""

    amounts: Float[AnyArray, "*batch kept amount"]
    root: Float[AnyArray, "*batch kept amount amount"]
    """Root of the information by what left the window (`root_of`)."""
    aim: Float[AnyArray, "*batch kept amount"]
    """The root times the amounts that this information speaks of."""
    past: Float[AnyArray, "*batch kept"]
    """Least negative log-likelihood of what left the window [nats]; infinite where there is no hypothesis."""
    honest: Float[AnyArray, "*batch kept amount amount"]
    """Root of the information by all that was heard, by the errors that are left (`Refined.honest`)."""
    cost: Float[AnyArray, "*batch kept"]
    """Negative log-likelihood of all that was heard [nats]."""
    volume: Float[AnyArray, "*batch kept"]
    """Logarithm of how large the region around the amounts is that explains it as well [nats]."""

    def remembering(
        self, expert: Expert, state: Float[AnyArray, " own"], reward: Float[AnyArray, ""], leaves: Bool[AnyArray, ""]
    ) -> "Hypotheses":
        """With the reward that leaves the window as information, to first order around each hypothesis."""

        def one(amount, root, aim, past):
            error, slope = jax.value_and_grad(lambda a: surprise(expert, state, reward, a))(amount)
            row = jnp.where(leaves, jnp.append(slope, slope @ amount - error), 0.0)
            whole = root_of(FADING**0.5 * jnp.concatenate([root, aim[:, None]], axis=1), row[None])
            return whole[:-1, :-1], whole[:-1, -1], FADING * past + 0.5 * whole[-1, -1] ** 2

        root, aim, past = jax.vmap(one)(self.amounts, self.root, self.aim, self.past)
        return Hypotheses(self.amounts, root, aim, past, self.honest, self.cost, self.volume)

    def forgetting(self, forget: Bool[AnyArray, ""]) -> "Hypotheses":
        """As places to begin from alone, where all is to be forgotten."""
        past = jnp.where(forget & jnp.isfinite(self.past), 0.0, self.past)
        root, aim = (jnp.where(forget, 0.0, each) for each in (self.root, self.aim))
        return Hypotheses(self.amounts, root, aim, past, self.honest, self.cost, self.volume)

    def spread(self, expert: Expert) -> Float[Array, " amount"]:
        """`spread_of` these hypotheses."""
        return spread_of(expert, self.amounts, self.honest, self.volume - self.cost)


def spread_of(
    expert: Expert,
    amounts: Float[AnyArray, "kept amount"],
    roots: Float[AnyArray, "kept amount amount"],
    evidence: Float[AnyArray, " kept"],
) -> Float[Array, " amount"]:
    """Variances of the amounts by which the place is in as much doubt as it is: around the likeliest hypothesis, which
    is the first, the others counted as likely as they are.

    A belief has variances alone, and amounts hang together: their own would leave a heading in doubt whose length,
    which means nothing, is unknown. So they are scaled, each by what it adds (as in Richardson 1972 and Lucy 1974).
    """
    chance = jax.nn.softmax(evidence)
    places, slopes = expert.place(amounts), jax.vmap(jax.jacfwd(expert.place))(amounts)
    within = jax.vmap(variance_along)(jnp.asarray(roots), slopes)
    around = within + apart(places, places[0], expert.fields, expert.scales) ** 2
    wanted = jnp.sum(jnp.where(chance[:, None] > 0, chance[:, None] * around, 0.0), axis=0)
    adds = slopes[0] ** 2
    variance = variance_along(roots[0], jnp.eye(amounts.shape[-1])) + LEAST
    for _ in range(SCALED):
        share = wanted / (adds @ variance + TINY)
        variance = variance * (share @ adds) / (jnp.sum(adds, axis=0) + TINY) + LEAST
    return variance


def no_hypotheses(shape: tuple[int, ...], amounts: int) -> Hypotheses:
    """Before anything is heard."""
    return Hypotheses(
        jnp.zeros((*shape, KEPT, amounts)),
        jnp.zeros((*shape, KEPT, amounts, amounts)),
        jnp.zeros((*shape, KEPT, amounts)),
        jnp.full((*shape, KEPT), jnp.inf),
        jnp.broadcast_to(jnp.eye(amounts), (*shape, KEPT, amounts, amounts)),
        jnp.full((*shape, KEPT), jnp.inf),
        jnp.zeros((*shape, KEPT)),
    )


def explain(
    heard: Heard, before: Hypotheses, guess: Belief, fresh: Float[AnyArray, ""], decision: Int[AnyArray, ""]
) -> Hypotheses:
    """The hypotheses after one more reward: those before, the encoder's guess [amount] and one of the starts all over
    the places are refined, and the likeliest that differ are kept. `fresh` is the past of one that is new.
    """
    size = guess.mean.shape[-1]
    tried = all_over(heard.expert, size)[(TRIED * decision + jnp.arange(TRIED)) % STARTS]
    new = jnp.concatenate([guess.mean[None], tried])
    begin = jnp.concatenate([before.amounts, new])
    root = jnp.concatenate([before.root, jnp.zeros((len(new), size, size))])
    aim = jnp.concatenate([before.aim, jnp.zeros((len(new), size))])
    past = jnp.concatenate([before.past, jnp.full(len(new), fresh)])
    precision = 1 / (GUESS_DEVIATIONS * jnp.sqrt(guess.variance))

    def refined(start, root, aim):
        return refine(heard, start, Known(root, aim, guess.mean, precision))

    ended = jax.vmap(refined)(begin, root, aim)
    cost = ended.cost + past
    cost = jnp.where(jnp.isfinite(cost), cost, jnp.inf)
    chosen, costs = _likeliest_apart(ended, cost)
    costs = jnp.where(costs < costs[0] + HOPELESS, costs, jnp.inf)
    return Hypotheses(
        amounts=ended.amount[chosen],
        root=root[chosen],
        aim=aim[chosen],
        past=jnp.where(jnp.isfinite(costs), past[chosen], jnp.inf),
        honest=ended.honest[chosen],
        cost=costs,
        volume=jax.vmap(_volume)(ended.root[chosen]),
    )


def _likeliest_apart(ended: Refined, cost: Float[Array, " candidate"]):
    """Indices of the likeliest candidates of which no two are the same, and their costs; infinite for none."""
    chosen, costs = [], []
    for _ in range(KEPT):
        best = jnp.argmin(cost)
        chosen.append(best)
        costs.append(cost[best])
        off = ended.amount - ended.amount[best]
        squared = jnp.sum((off @ ended.root[best].T) ** 2, axis=-1)
        cost = jnp.where(squared > APART**2, cost, jnp.inf)
    return jnp.stack(chosen), jnp.stack(costs)


def _volume(root: Float[Array, "amount amount"]) -> Float[Array, ""]:
    """By Laplace's approximation, beside amounts as they are before anything is heard: a unit Gaussian (thesis 5.6)."""
    return -0.5 * log_determinant(root_of(root, jnp.eye(root.shape[-1])))


def all_over(expert: Expert, size: int) -> Float[AnyArray, "start amount"]:
    """Amounts of places on both sides, near and far, or all around: whatever an expert may mean."""
    if len(expert.fields) == 1:
        # sides alternate, so that two decisions have tried both
        ahead = np.array([0.5, -0.5, 1.0, -1.0, 0.25, -0.25, 0.75, -0.75])
        (field,) = expert.fields
        places = ahead[:, None] * (np.pi / expert.scales[0] if field in CIRCULAR else 1.0)
    else:
        turn = np.linspace(0, 2 * np.pi, STARTS, endpoint=False)
        rest = [np.zeros_like(turn)] * (len(expert.fields) - 2)
        places = 0.7 * np.stack([np.cos(turn), np.sin(turn), *rest], axis=-1)
    return amounts_of(expert, jnp.asarray(places, jnp.float32))


def amounts_of(expert: Expert, place: Float[AnyArray, "*batch own"]) -> Float[AnyArray, "*batch amount"]:
    """The smallest amounts that mean a place, scaled as the encoder's fields."""
    inputs = seen(place, expert.fields, expert.scales)
    return (inputs - expert.reference.biases[0]) @ jnp.linalg.pinv(expert.reference.weights[0])
