"""How refined hypotheses become a belief: the encoder's guess with the likeliest amounts and families in its place."""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from rebody.inference.decoder import Decoder
from rebody.types import AnyArray, Belief

UNLIKELIEST = -1.0
"""Log-probability that the encoder leaves every family at least: it is often too sure."""
SUREST = -8.0
"""Least log-probability that a belief tells of a family: beyond, its kinds would lie far from all that is learned."""


def proposed(decoder: Decoder, guess: Belief) -> tuple[Float[Array, " expert"], list[Belief]]:
    """What the encoder says: log-probability of each expert, and its amounts."""
    kinds = decoder.kinds
    log_share = jax.nn.log_softmax(decoder.choice(guess.mean[:kinds])) if decoder.choice else jnp.zeros(1)
    means, variances = (decoder.amounts(numbers[kinds:]) for numbers in (guess.mean, guess.variance))
    return log_share, [Belief(*each) for each in zip(means, variances, strict=True)]


def likely_families(log_share: Float[AnyArray, " expert"]) -> Float[Array, " expert"]:
    """What the encoder's probabilities count for beside what was heard."""
    return jnp.maximum(log_share, UNLIKELIEST)


def told(
    decoder: Decoder,
    guess: Belief,
    log_share: Float[AnyArray, " expert"],
    evidence: Float[AnyArray, " expert"],
    amounts: Sequence[Float[AnyArray, " _"]],
    spreads: Sequence[Float[AnyArray, " _"]],
    tells_evidence: bool,
) -> Belief:
    """The likeliest amounts of each expert with their variances, and kinds that say how likely each family is by the
    evidence [nats]."""
    kind, choice = guess.mean[: decoder.kinds], decoder.choice
    if choice is not None:
        logits = jnp.asarray(choice(kind))
        wanted = _wanted(logits, log_share, evidence, tells_evidence)
        kind = kind + (wanted - logits) @ jnp.linalg.pinv(choice.weights[0])
    return Belief(
        jnp.concatenate([kind, *amounts]),
        jnp.concatenate([guess.variance[: decoder.kinds], *spreads]),
    )


def _wanted(
    logits: Float[Array, " expert"],
    log_share: Float[AnyArray, " expert"],
    evidence: Float[AnyArray, " expert"],
    tells_evidence: bool,
) -> Float[Array, " expert"]:
    """What the decoder is to read from the kinds."""
    if tells_evidence:
        wanted = jnp.maximum(jax.nn.log_softmax(evidence), SUREST)
        return wanted + jnp.mean(logits) - jnp.mean(wanted)
    first, best = jnp.argmax(log_share), jnp.argmax(evidence)
    return logits.at[first].set(logits[best]).at[best].set(logits[first])
