"""What is believed of one expert's amounts: a few hypotheses, carried from decision to decision."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from rebody.inference.decoder import Expert
from rebody.inference.inputs import CIRCULAR, seen
from rebody.inference.refine import RIDGE, Heard, Known, Refined, refine, surprise
from rebody.inference.roots import covariance, log_determinant, root_of
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
FADING = 0.998
"""Of what left the window, at each decision."""


class Hypotheses(eqx.Module):
    """Amounts that explain what was heard, the most likely first."""

    amounts: Float[AnyArray, "*batch kept amount"]
    root: Float[AnyArray, "*batch kept amount amount"]
    """Root of the information by what left the window, around the amounts (`root_of`)."""
    past: Float[AnyArray, "*batch kept"]
    """Negative log-likelihood of what left the window [nats]; infinite where there is no hypothesis."""
    variance: Float[AnyArray, "*batch kept amount"]
    cost: Float[AnyArray, "*batch kept"]
    """Negative log-likelihood of all that was heard [nats]."""
    volume: Float[AnyArray, "*batch kept"]
    """Logarithm of how large the region around the amounts is that explains it as well [nats]."""

    def remembering(
        self, expert: Expert, state: Float[AnyArray, " own"], reward: Float[AnyArray, ""], leaves: Bool[AnyArray, ""]
    ) -> "Hypotheses":
        """With the reward that leaves the window as information, to first order around each hypothesis."""

        def one(amount, root, past):
            error, slope = jax.value_and_grad(lambda a: surprise(expert, state, reward, a))(amount)
            root = root_of(FADING**0.5 * root, jnp.where(leaves, slope, 0.0)[None])
            return root, FADING * past + jnp.where(leaves, 0.5 * error**2, 0.0)

        root, past = jax.vmap(one)(self.amounts, self.root, self.past)
        return Hypotheses(self.amounts, root, past, self.variance, self.cost, self.volume)

    def forgetting(self, forget: Bool[AnyArray, ""]) -> "Hypotheses":
        """As places to begin from alone, where all is to be forgotten."""
        past = jnp.where(forget & jnp.isfinite(self.past), 0.0, self.past)
        root = jnp.where(forget, 0.0, self.root)
        return Hypotheses(self.amounts, root, past, self.variance, self.cost, self.volume)


def no_hypotheses(shape: tuple[int, ...], amounts: int) -> Hypotheses:
    """Before anything is heard."""
    return Hypotheses(
        jnp.zeros((*shape, KEPT, amounts)),
        jnp.zeros((*shape, KEPT, amounts, amounts)),
        jnp.full((*shape, KEPT), jnp.inf),
        jnp.ones((*shape, KEPT, amounts)),
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
    past = jnp.concatenate([before.past, jnp.full(len(new), fresh)])
    precision = 1 / (GUESS_DEVIATIONS * jnp.sqrt(guess.variance))
    ended = jax.vmap(lambda start, known: refine(heard, start, Known(start, known, guess.mean, precision)))(begin, root)
    cost = ended.cost + past
    cost = jnp.where(jnp.isfinite(cost), cost, jnp.inf)
    chosen, costs = _likeliest_apart(ended, cost)
    costs = jnp.where(costs < costs[0] + HOPELESS, costs, jnp.inf)
    return Hypotheses(
        amounts=ended.amount[chosen],
        root=root[chosen],
        past=jnp.where(jnp.isfinite(costs), past[chosen], jnp.inf),
        variance=jnp.clip(jax.vmap(_variances)(ended.root[chosen]), 1e-9, guess.variance),
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


def _variances(root: Float[Array, "amount amount"]) -> Float[Array, " amount"]:
    return jnp.diagonal(covariance(root_of(root, RIDGE**0.5 * jnp.eye(root.shape[-1]))))


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
    inputs = seen(jnp.asarray(places, jnp.float32), expert.fields, expert.scales)
    return (inputs - expert.reference.biases[0]) @ jnp.linalg.pinv(expert.reference.weights[0])
