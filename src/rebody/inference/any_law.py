"""Sharp beliefs for rewards of any scale and form: hypotheses about the task and the law that it is paid by.

It stands where `Sharpened` stands, for modules that learned to hear any law (docs/any-law.md).
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from rebody.inference.decoder import Decoder, Expert
from rebody.inference.encoder import Encoder, EncoderCarry
from rebody.inference.fitting import Evidence, Fit, fit, share_explained
from rebody.inference.hypotheses import APART, amounts_of, spread_of
from rebody.inference.inputs import CIRCULAR, scaled
from rebody.inference.law import LATEST, PARAMETERS, Kind, Late, Rewards, begun, kinds_of, prior_of, rewards_by
from rebody.inference.telling import likely_families, proposed, told
from rebody.inference.thinned import Thinned, nothing_heard
from rebody.types import AnyArray, Belief, Transition

KEPT, TRIED = 4, 2
"""Hypotheses of an expert, and kinds of law that are tried at a decision from each place to begin."""
FIRST_SHARP = 4
"""Rewards that a sharp belief needs: fewer are explained by any family, and the encoder knows what is likely."""
SETTLED = 10
"""Rewards after which a hypothesis can be surprised."""
SURPRISED, TWICE = 8.0, 2
"""The task has changed where so many rewards in a row lie so many standard deviations from the likeliest hypothesis,
though that may have moved to meet them."""
GOLDEN = 0.5 * (5**0.5 - 1)


class LawHypotheses(eqx.Module):
    """Tasks and laws that explain what was heard, the most likely first."""

    parameters: Float[AnyArray, "*batch kept parameter"]
    """Of the law, then the amounts (`rebody.inference.law`)."""
    kind: Kind  # [*batch, kept]
    cost: Float[AnyArray, "*batch kept"]
    """Minus the logarithm of the evidence [nats]; infinite where there is no hypothesis."""
    honest: Float[AnyArray, "*batch kept amount amount"]
    """Root of the information about the amounts by all that was heard."""
    noise: Float[AnyArray, "*batch kept"]
    """Standard deviation of the rewards about it, in their unit."""

    @property
    def amounts(self) -> Float[AnyArray, "*batch kept amount"]:
        """Of the expert."""
        return self.parameters[..., PARAMETERS:]


class LawMemory(eqx.Module):
    """What is carried from decision to decision."""

    carry: EncoderCarry | None
    """Of the encoder; None while one body is looked at alone."""
    heard: Thinned
    experts: tuple[LawHypotheses, ...]
    noise: Float[AnyArray, "*batch"]
    """Of the likeliest hypothesis when it was surprised last by nothing."""
    surprises: Int[AnyArray, "*batch"]
    """In a row."""
    decisions: Int[AnyArray, "*batch"]


class SharpenedByAnyLaw(eqx.Module):
    """An encoder whose beliefs are refined, together with the law that rewards are paid by."""

    encoder: Encoder
    decoder: Decoder

    def initial(self, shape: tuple[int, ...] = ()) -> LawMemory:
        """Nothing heard yet."""
        amounts = (self.encoder.latent - self.encoder.kinds) // len(self.decoder.experts)
        return LawMemory(
            self.encoder.initial(shape),
            nothing_heard(shape, LATEST + 1, len(self.encoder.fields)),
            tuple(_no_hypotheses(expert, shape, amounts) for expert in self.decoder.experts),
            jnp.full(shape, jnp.inf),
            jnp.zeros(shape, jnp.int32),
            jnp.zeros(shape, jnp.int32),
        )

    def prior(self, shape: tuple[int, ...] = ()) -> Belief:
        """The belief before the first transition: the encoder's."""
        return self.encoder.prior(shape)

    def step(self, memory: LawMemory, transition: Transition) -> tuple[LawMemory, Belief]:
        """One decision: take in a transition, say what is believed now."""
        assert memory.carry is not None
        carry, guess = self.encoder.step(memory.carry, transition)
        own = eqx.tree_at(lambda m: m.carry, memory, None)
        one = self._of_one_body
        for _ in guess.mean.shape[:-1]:
            one = jax.vmap(one)
        previous, state = self._scaled(transition.previous), self._scaled(transition.state)
        own, belief = one(own, guess, previous, state, jnp.asarray(transition.reward, jnp.float32))
        return eqx.tree_at(lambda m: m.carry, own, carry, is_leaf=lambda leaf: leaf is None), belief

    def unheard(self, memory: LawMemory, transition: Transition) -> LawMemory:
        """A decision in which nothing was heard: a later reward may be for its state."""
        one = self._seeing
        for _ in jnp.shape(transition.state.x):
            one = jax.vmap(one)
        states = [self._scaled(state) for state in (transition.previous, transition.state)]
        return eqx.tree_at(lambda m: m.heard, memory, one(memory.heard, *states))

    def explained(self, memory: LawMemory) -> Float[Array, "*batch"]:
        """Share of the variance of the remembered rewards that the likeliest hypothesis explains, in [0, 1].

        Near 1 for a known family and law, near 0 for rewards that no known task pays (`share_explained`).
        """
        cost = jnp.stack([each.cost[..., 0] for each in memory.experts], axis=-1)
        noise = jnp.stack([each.noise[..., 0] for each in memory.experts], axis=-1)
        free = jnp.asarray([PARAMETERS + len(expert.fields) for expert in self.decoder.experts])
        best = jnp.argmin(cost, axis=-1)
        least = jnp.take_along_axis(noise, best[..., None], axis=-1)[..., 0]
        # an entry that stands for many rewards is one number still
        entries = jnp.sum(memory.heard.weights > 0, axis=-1)
        return share_explained(least, memory.heard.variance, entries, free[best])

    def _scaled(self, state):
        return scaled(state, self.encoder.fields, self.encoder.scales)

    def _of_one_body(self, memory: LawMemory, guess: Belief, previous, state, reward) -> tuple[LawMemory, Belief]:
        heard = self._seeing(memory.heard, previous, state)
        expected = self._expected(memory.experts, heard.states)
        heard = heard.hearing(reward, expected, self.encoder.fields, self.encoder.scales)
        log_share, guesses = proposed(self.decoder, guess)
        before = self._likeliest(memory.experts)
        experts = tuple(
            self._explain(expert, heard, each, own_guess.mean, memory.decisions)
            for expert, each, own_guess in zip(self.decoder.experts, memory.experts, guesses, strict=True)
        )
        memory = LawMemory(None, heard, experts, memory.noise, memory.surprises, memory.decisions + 1)
        memory = self._surprised(memory, before, reward)
        return memory, self._belief(guess, log_share, experts, heard)

    def _seeing(self, heard: Thinned, previous, state) -> Thinned:
        begun = jax.tree.map(lambda new, old: jnp.where(heard.has_seen, old, new), heard.seeing(previous), heard)
        return begun.seeing(state)

    def _explain(self, expert: Expert, heard: Thinned, before: LawHypotheses, guess, decision) -> LawHypotheses:
        """The hypotheses after one more reward: those before, and from three places to begin (the encoder's guess, the
        likeliest, and one somewhere) laws of two kinds each; the likeliest that differ are kept."""
        kinds = kinds_of(expert)
        evidence = Evidence(
            Late.of(expert, self._read(expert, heard.states)), heard.rewards, heard.weights, jnp.asarray(heard.spread)
        )
        rewards = Rewards(*heard.ends, evidence.spread)
        somewhere = _somewhere(expert, len(guess), decision)
        places = jnp.repeat(jnp.stack([guess, before.amounts[0], somewhere]), TRIED, axis=0)
        which = (TRIED * decision + jnp.arange(len(places))) % jnp.size(kinds.exponent)
        new_kinds = jax.tree.map(lambda column: column[which], kinds)

        def begin(kind, amounts):
            return begun(expert, evidence.states, evidence.rewards, evidence.weights, kind, amounts, evidence.spread)

        starts = jnp.concatenate([before.parameters, jax.vmap(begin)(new_kinds, places)])
        kind = jax.tree.map(lambda old, new: jnp.concatenate([old, new]), before.kind, new_kinds)

        def fitted(kind, start):
            return fit(expert, evidence, kind, prior_of(expert, len(guess), kind, rewards), start)

        ended = jax.vmap(fitted)(kind, starts)
        chosen = _likeliest_apart(ended, kind)
        return LawHypotheses(
            ended.parameters[chosen],
            jax.tree.map(lambda column: column[chosen], kind),
            ended.cost[chosen],
            ended.root[chosen],
            ended.noise[chosen],
        )

    def _read(self, expert: Expert, states):
        return self.decoder.read(expert, states)

    def _expected(
        self, experts: tuple[LawHypotheses, ...], states: Float[AnyArray, "heard late field"]
    ) -> Float[Array, " heard"]:
        """What the likeliest hypothesis says is paid in these states."""
        best, _ = self._likeliest(experts)
        of_each = [
            rewards_by(
                expert,
                Late.of(expert, self._read(expert, states)),
                jax.tree.map(lambda column: column[0], each.kind),
                each.parameters[0],
            )
            for expert, each in zip(self.decoder.experts, experts, strict=True)
        ]
        return jnp.stack(of_each)[best]

    def _likeliest(self, experts: tuple[LawHypotheses, ...]):
        """Index of the expert, and the noise about it."""
        best = jnp.argmin(jnp.stack([each.cost[0] for each in experts]))
        return best, jnp.stack([each.noise[0] for each in experts])[best]

    def _surprised(self, memory: LawMemory, before, reward) -> LawMemory:
        """With the older rewards forgotten where the task has become another one."""
        heard, (_, noise_before) = memory.heard, before
        _, noise = self._likeliest(memory.experts)
        (newest,) = self._expected(memory.experts, heard.recent[None])
        level = jnp.where(memory.surprises > 0, memory.noise, noise_before)
        is_settled = jnp.sum(heard.weights) > SETTLED
        is_odd = (jnp.abs(reward - newest) > SURPRISED * level) & (noise > 2 * level) & is_settled
        surprises = jnp.where(is_odd, memory.surprises + 1, 0)
        changed = surprises >= TWICE
        return LawMemory(
            None,
            heard.forgetting(changed, TWICE),
            memory.experts,
            level,
            jnp.where(changed, 0, surprises),
            memory.decisions,
        )

    def _belief(self, guess: Belief, log_share, experts: tuple[LawHypotheses, ...], heard: Thinned) -> Belief:
        evidence = likely_families(log_share) - jnp.stack([each.cost[0] for each in experts])
        spreads = [
            spread_of(expert, each.amounts, each.honest, -each.cost)
            for expert, each in zip(self.decoder.experts, experts, strict=True)
        ]
        sharp = told(self.decoder, guess, log_share, evidence, [each.amounts[0] for each in experts], spreads, True)
        is_sharp = jnp.sum(heard.weights) >= FIRST_SHARP
        return jax.tree.map(lambda first, then: jnp.where(is_sharp, then, first), guess, sharp)


def _likeliest_apart(ended: Fit, kind: Kind) -> Int[Array, " kept"]:
    """Indices of the likeliest of which no two mean the same place by the same kind of law."""
    chosen, cost, amounts = [], ended.cost, ended.parameters[:, PARAMETERS:]
    shapes = jnp.stack([kind.exponent, kind.is_gaussian, kind.is_clipped, kind.is_l1], axis=-1)
    for _ in range(KEPT):
        best = jnp.argmin(cost)
        chosen.append(best)
        off = (amounts - amounts[best]) @ ended.root[best].T
        is_same = (jnp.sum(off**2, axis=-1) < APART**2) & jnp.all(shapes == shapes[best], axis=-1)
        cost = jnp.where(is_same, jnp.inf, cost).at[best].set(jnp.inf)
    return jnp.stack(chosen)


def _somewhere(expert: Expert, size: int, decision: Int[AnyArray, ""]) -> Float[AnyArray, " amount"]:
    """Amounts of a place that is another one at every decision, evenly all over what an expert may mean."""
    share, turn = (decision * GOLDEN) % 1.0, (decision * GOLDEN**2) % 1.0
    if len(expert.fields) == 1:
        (field,) = expert.fields
        far = np.pi / expert.scales[0] if field in CIRCULAR else 1.2
        place = jnp.asarray([far * (2 * share - 1)])
    else:
        length, bearing = 0.2 + share, 2 * np.pi * turn
        place = jnp.concatenate(
            [length * jnp.stack([jnp.cos(bearing), jnp.sin(bearing)]), jnp.zeros(len(expert.fields) - 2)]
        )
    return amounts_of(expert, place)


def _no_hypotheses(expert: Expert, shape: tuple[int, ...], amounts: int) -> LawHypotheses:
    kind = jax.tree.map(lambda column: jnp.broadcast_to(column[0], (*shape, KEPT)), kinds_of(expert))
    return LawHypotheses(
        jnp.zeros((*shape, KEPT, PARAMETERS + amounts)),
        kind,
        jnp.full((*shape, KEPT), jnp.inf),
        jnp.broadcast_to(jnp.eye(amounts), (*shape, KEPT, amounts, amounts)),
        jnp.full((*shape, KEPT), jnp.inf),
    )
