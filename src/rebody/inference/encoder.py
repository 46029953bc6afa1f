"""The encoder: a belief about the task from the last W transitions (thesis 5.3.3)."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.inference.inputs import inputs_of, rates, scaled, seen
from rebody.inference.normaliser import Normaliser, no_moments
from rebody.nn import GRU, MLP
from rebody.types import DECISION_DT, AnyArray, Belief, Transition

VARIANCE_RANGE = (1e-6, 4.0)


class EncoderCarry(eqx.Module):
    """W recurrent states, each begun one decision after the other.

    The oldest has seen exactly the last W transitions, so a belief over a sliding window costs one
    batched cell step a decision, and no window has to be stored. Without a window there is one state, which
    has seen everything.
    """

    hidden: Float[AnyArray, "*batch window units"]
    last: Float[AnyArray, "*batch feature"]  # features of the newest transition
    ticks: Int[AnyArray, ""]
    moments: Normaliser | None = None  # of the rewards, where these are normalised


class Encoder(eqx.Module):
    """GRU over a window of (state, reward, next state): no action ever enters.

    One that is to hear any law has rewards in units of what was heard shortly before.
    """

    embed: MLP
    cell: GRU
    head: MLP
    gate: MLP
    fields: tuple[str, ...] = eqx.field(static=True)
    scales: tuple[float, ...] = eqx.field(static=True)
    reward_scale: float = eqx.field(static=True)
    window: int | None = eqx.field(static=True)
    latent: int = eqx.field(static=True)
    kinds: int = eqx.field(static=True)
    normalises: bool = eqx.field(static=True)

    def __init__(
        self,
        *,
        fields: tuple[str, ...],
        scales: tuple[float, ...],
        reward_scale: float,
        window: int | None,
        latent: int,
        kinds: int,
        units: int,
        normalises: bool = False,
        key: PRNGKeyArray,
    ):
        """`scales` divide the fields (m, rad, m/s), `reward_scale` the reward: all near 1 afterwards.

        The first `kinds` of the latent's dimensions say what kind of task it is.
        """
        keys = jax.random.split(key, 4)
        inputs = inputs_of(fields) + len(fields) + 2
        self.embed = MLP(2 * inputs, units, (units,), key=keys[0])
        self.cell = GRU(units, units, key=keys[1])
        self.head = MLP(units + inputs, 2 * latent, (2 * units, 2 * units), key=keys[2])
        self.gate = MLP(units, (latent - kinds) * inputs, (units,), key=keys[3], last_scale=0.1)
        self.fields, self.scales, self.reward_scale = fields, scales, reward_scale
        self.window, self.latent, self.kinds, self.normalises = window, latent, kinds, normalises

    def initial(self, shape: tuple[int, ...] = ()) -> EncoderCarry:
        """Nothing seen yet."""
        return EncoderCarry(
            jnp.zeros((*shape, self.window or 1, self.cell.units)),
            jnp.zeros((*shape, inputs_of(self.fields) + len(self.fields) + 2)),
            jnp.zeros((), jnp.int32),
            no_moments(shape) if self.normalises else None,
        )

    def prior(self, shape: tuple[int, ...] = ()) -> Belief:
        """The belief before the first transition: a unit Gaussian."""
        return Belief(jnp.zeros((*shape, self.latent)), jnp.ones((*shape, self.latent)))

    def step(self, carry: EncoderCarry, transition: Transition) -> tuple[EncoderCarry, Belief]:
        """One decision: take in a transition, say what is believed now."""
        moments = carry.moments
        if moments is not None:
            moments = moments.hearing(transition.reward)
            transition = Transition(transition.previous, moments(transition.reward), transition.state)
        features = self.features(transition)
        window = self.window or jnp.iinfo(jnp.int32).max
        begins = carry.ticks % window
        is_new = (jnp.arange(carry.hidden.shape[-2]) == begins)[:, None]
        inputs = jnp.where(
            is_new,
            self._embed(features, features)[..., None, :],
            self._embed(features, carry.last)[..., None, :],
        )
        hidden = self.cell(jnp.where(is_new, 0.0, carry.hidden), inputs)
        oldest = jnp.where(carry.ticks < window, 0, (carry.ticks + 1) % window)
        belief = self.belief(jnp.take(hidden, oldest, axis=-2), features)
        return EncoderCarry(hidden, features, carry.ticks + 1, moments), belief

    def unheard(self, carry: EncoderCarry, transition: Transition) -> EncoderCarry:
        """A decision in which no reward was heard leaves no trace; the transition's reward means nothing."""
        return carry

    def along(self, transitions: Transition) -> Belief:
        """Beliefs after each of up to W transitions on the last axis, nothing known before the first; rewards are
        normalised already where they are to be.

        Shapes: transitions [*batch, time], belief [*batch, time, latent].
        """
        features = self.features(transitions)
        last = jnp.concatenate([features[..., :1, :], features[..., :-1, :]], axis=-2)
        inputs = jnp.moveaxis(self._embed(features, last), -2, 0)

        def step(hidden, embedded):
            hidden = self.cell(hidden, embedded)
            return hidden, hidden

        start = jnp.zeros((*inputs.shape[1:-1], self.cell.units))
        _, hidden = jax.lax.scan(step, start, inputs)
        return self.belief(jnp.moveaxis(hidden, 0, -2), features)

    def _embed(self, features: Float[AnyArray, "*batch feature"], last: Float[AnyArray, "*batch feature"]):
        """Features and their change since the transition before: does the reward rise or fall?"""
        return self.embed(jnp.concatenate([features, (features - last) / DECISION_DT], axis=-1))

    def features(self, transition: Transition) -> Float[AnyArray, "*batch feature"]:
        """Where it is, how it moved, and the reward, once more compressed so that small ones show."""
        fields, scales = self.fields, self.scales
        now, before = (scaled(state, fields, scales) for state in (transition.state, transition.previous))
        state, change = seen(now, fields, scales), rates(now, before, fields, scales)
        reward = transition.reward / self.reward_scale
        rewards = jnp.stack([reward, 0.3 * jnp.arcsinh(50 * reward)], axis=-1)
        return jnp.concatenate([state, change, rewards], axis=-1)

    def belief(self, hidden: Float[AnyArray, "*batch units"], features: Float[AnyArray, "*batch feature"]) -> Belief:
        """Read a belief from a recurrent state and the newest transition's features."""
        mean, raw = jnp.split(self.head(jnp.concatenate([hidden, features], axis=-1)), 2, axis=-1)
        gates = self.gate(hidden).reshape(*hidden.shape[:-1], self.latent - self.kinds, features.shape[-1])
        # how much is asked moves with the newest features; what kind it is does not
        mean = mean.at[..., self.kinds :].add(jnp.einsum("...lf,...f->...l", gates, features))
        low, high = VARIANCE_RANGE
        return Belief(mean, jnp.exp(jnp.clip(raw - 2.0, jnp.log(low), jnp.log(high))))
