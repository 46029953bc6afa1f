"""Sharp beliefs: the encoder proposes, a few Gauss-Newton steps on the decoder's likelihood refine.

What the encoder says at once (amortised inference, thesis 5.3.3) is where the maximisation of the likelihood begins
(semi-amortised: Kim et al. 2018; Marino et al. 2018). The module stays frozen. docs/sharp-beliefs.md has the
mathematics.
"""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from rebody.inference.decoder import Decoder
from rebody.inference.encoder import Encoder, EncoderCarry
from rebody.inference.hypotheses import HOPELESS, Hypotheses, explain, no_hypotheses
from rebody.inference.inputs import scaled
from rebody.inference.refine import Heard, surprise
from rebody.inference.telling import likely_families, proposed, told
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, Transition

SURPRISED, MORE_THAN_GUESS = 6.0, 1.5
"""The task has changed where a reward lies so many standard deviations from what any likely hypothesis expects, and so
many times as far as from what the encoder's guess does; or where no hypothesis is nearer to the whole window."""
NEW = 10.0
"""What a new hypothesis pays for the past that others have explained [nats]."""
FIRST_SHARP = 3
"""Rewards that a sharp belief needs: fewer are explained by any family, and the encoder knows what is likely."""


class Memory(eqx.Module):
    """What is carried from decision to decision."""

    carry: EncoderCarry
    states: Float[AnyArray, "*batch window field"]
    rewards: Float[AnyArray, "*batch window"]
    heard: Int[AnyArray, "*batch"]
    """Transitions since the task is what it is."""
    experts: tuple[Hypotheses, ...]


class Sharpened(eqx.Module):
    """An encoder whose beliefs are refined; it stands where an encoder stands, and its memory is larger.

    The latent says what it said: the likeliest hypothesis' amounts of each expert, and which family is meant.
    """

    encoder: Encoder
    decoder: Decoder
    tells_evidence: bool = eqx.field(static=True, default=False)
    """Whether kinds say how likely each family is by the evidence. A policy that learned by the encoder's beliefs knows
    those alone: for it the logits of the likeliest family and of the encoder's are exchanged."""

    def initial(self, shape: tuple[int, ...] = ()) -> Memory:
        """Nothing heard yet."""
        encoder, window = self.encoder, self._window
        amounts = (encoder.latent - encoder.kinds) // len(self.decoder.experts)
        return Memory(
            encoder.initial(shape),
            jnp.zeros((*shape, window, len(encoder.fields))),
            jnp.zeros((*shape, window)),
            jnp.zeros(shape, jnp.int32),
            (no_hypotheses(shape, amounts),) * len(self.decoder.experts),
        )

    def prior(self, shape: tuple[int, ...] = ()) -> Belief:
        """The belief before the first transition: the encoder's."""
        return self.encoder.prior(shape)

    def step(self, memory: Memory, transition: Transition) -> tuple[Memory, Belief]:
        """One decision: take in a transition, say what is believed now."""
        encoder = self.encoder
        carry, guess = encoder.step(memory.carry, transition)
        state = scaled(transition.state, encoder.fields, encoder.scales)
        one = self._of_one_body
        for _ in guess.mean.shape[:-1]:
            one = jax.vmap(one)
        own = (memory.states, memory.rewards, memory.heard, memory.experts)
        own, belief = one(own, guess, state, jnp.asarray(transition.reward) / encoder.reward_scale)
        return Memory(carry, *own), belief

    def unheard(self, memory: Memory, transition: Transition) -> Memory:
        """A decision in which no reward was heard leaves no trace; the transition's reward means nothing."""
        return memory

    @property
    def _window(self) -> int:
        assert self.encoder.window is not None  # `can_sharpen`
        return self.encoder.window

    def _of_one_body(self, own, guess: Belief, state: Float[AnyArray, " field"], reward: Float[AnyArray, ""]):
        """Window, rewards, how many and hypotheses after one more transition, and the belief."""
        states, rewards, heard, hypotheses = own
        decoder, window = self.decoder, self._window
        log_share, guesses = proposed(decoder, guess)
        changed = self._is_surprised(hypotheses, log_share, guesses, state, reward) | self._explains_nothing(own)
        changed = changed & (heard > 0)
        heard = jnp.where(changed, 0, heard)
        # what leaves the window stays as information: a body that stands still hears nothing new
        hypotheses = [
            each.forgetting(changed).remembering(expert, decoder.read(expert, states[0]), rewards[0], heard >= window)
            for expert, each in zip(decoder.experts, hypotheses, strict=True)
        ]
        states = jnp.concatenate([states[1:], state[None]])
        rewards = jnp.concatenate([rewards[1:], reward[None]])
        heard = heard + 1
        is_heard = jnp.arange(window) >= window - heard
        least = jnp.min(jnp.stack([each.past for each in hypotheses]))
        fresh = jnp.where(jnp.isfinite(least), least + jnp.where(heard > window, NEW, 0.0), 0.0)
        hypotheses = tuple(
            explain(Heard(expert, decoder.read(expert, states), rewards, is_heard), each, own_guess, fresh, heard)
            for expert, each, own_guess in zip(decoder.experts, hypotheses, guesses, strict=True)
        )
        sharp = self._belief(guess, log_share, hypotheses, heard <= window)
        belief = jax.tree.map(lambda first, then: jnp.where(heard < FIRST_SHARP, first, then), guess, sharp)
        return (states, rewards, heard, hypotheses), belief

    def _is_surprised(
        self, hypotheses: Sequence[Hypotheses], log_share, guesses: list[Belief], state, reward
    ) -> Bool[Array, ""]:
        """Whether no likely hypothesis expected this reward, and the encoder's guess did better."""
        least, of_guess, best = [], [], _least(hypotheses)
        for expert, each, guess in zip(self.decoder.experts, hypotheses, guesses, strict=True):
            seen = self.decoder.read(expert, state)
            far = jnp.abs(jax.vmap(lambda amount, on=expert, at=seen: surprise(on, at, reward, amount))(each.amounts))
            least.append(jnp.min(jnp.where(each.cost < best + HOPELESS, far, jnp.inf)))
            of_guess.append(jnp.abs(surprise(expert, seen, reward, guess.mean)))
        nearest = jnp.min(jnp.stack(least))
        return (nearest > SURPRISED) & (nearest > MORE_THAN_GUESS * jnp.stack(of_guess)[jnp.argmax(log_share)])

    def _explains_nothing(self, own) -> Bool[Array, ""]:
        """Whether the likeliest hypothesis is far from the window's rewards: they are of two tasks, or of none."""
        _, _, heard, hypotheses = own
        pasts = [jnp.where(jnp.isfinite(each.past), each.past, 0.0) for each in hypotheses]
        in_window = jnp.stack([jnp.min(each.cost - past) for each, past in zip(hypotheses, pasts, strict=True)])
        return jnp.min(in_window) > 0.5 * SURPRISED**2 * jnp.minimum(heard, self._window)

    def _belief(self, guess: Belief, log_share, hypotheses: Sequence[Hypotheses], is_all: Bool[Array, ""]) -> Belief:
        """The likeliest hypothesis of each expert, and how likely each family is by the evidence."""
        explained = jnp.stack([jnp.where(is_all, each.volume[0], 0.0) - each.cost[0] for each in hypotheses])
        spreads = [each.spread(expert) for expert, each in zip(self.decoder.experts, hypotheses, strict=True)]
        amounts, evidence = [each.amounts[0] for each in hypotheses], likely_families(log_share) + explained
        return told(self.decoder, guess, log_share, evidence, amounts, spreads, self.tells_evidence)


def _least(hypotheses: Sequence[Hypotheses]) -> Float[Array, ""]:
    """Cost of the likeliest of all [nats]."""
    return jnp.min(jnp.stack([jnp.min(each.cost) for each in hypotheses]))


def can_sharpen(encoder: Encoder, decoder: Decoder, families: FamilySet) -> bool:
    """Whether a module's decoder says which place is meant: an expert for each family, and a window to explain."""
    is_alone = len(families) == 1 and families[0].quantity.components == encoder.fields
    return encoder.window is not None and (decoder.choice is not None or is_alone)
