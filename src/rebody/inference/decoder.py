"""The decoder: (state, action, latent) -> (next state, reward), used in training only."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Key, PRNGKeyArray

from rebody.inference.inputs import CIRCULAR, apart, inputs_of, seen
from rebody.inference.prior import split
from rebody.nn import MLP
from rebody.tasks import FamilySet
from rebody.tasks.quantities import length
from rebody.types import AnyArray, Belief


class Prediction(eqx.Module):
    """One reward, told by several experts: a mixture of Gaussians of one variance."""

    mean: Float[AnyArray, "*batch expert"]
    log_share: Float[AnyArray, "*batch expert"]
    log_variance: Float[AnyArray, "*batch"]

    @property
    def expectation(self) -> Float[AnyArray, "*batch"]:
        """Mean over the experts."""
        return jnp.sum(jnp.exp(self.log_share) * self.mean, axis=-1)

    def log_likelihood(self, value: Float[AnyArray, "*batch"]) -> Float[AnyArray, "*batch"]:
        """Log-density of a value, but for a constant [nats]."""
        squared = (value[..., None] - self.mean) ** 2 * jnp.exp(-self.log_variance)[..., None]
        return jax.nn.logsumexp(self.log_share - 0.5 * squared, axis=-1) - 0.5 * self.log_variance


class Expert(eqx.Module):
    """Reads a reward as a weighted distance of some fields from a point that is linear in an amount.

    Where the fields are one family's quantity it is their Euclidean length, else each field has a weight of its own.
    """

    reference: MLP
    weights: MLP | None
    """None for one that any law may be about."""
    fields: tuple[str, ...] = eqx.field(static=True)
    scales: tuple[float, ...] = eqx.field(static=True)
    is_quantity: bool = eqx.field(static=True)

    def __init__(
        self,
        fields: tuple[str, ...],
        scales: tuple[float, ...],
        amounts: int,
        units: int,
        is_quantity: bool,
        hears_any_law: bool = False,
        *,
        keys: Key[AnyArray, "2"],
    ):
        self.fields, self.scales, self.is_quantity = fields, scales, is_quantity
        self.reference = MLP(amounts, inputs_of(fields), (), key=keys[0])
        weights = 1 if is_quantity else len(fields)
        self.weights = None if hears_any_law else MLP(amounts, weights, (units,), key=keys[1])

    def __call__(
        self, state: Float[AnyArray, "*#batch field"], amount: Float[AnyArray, "*#batch amount"]
    ) -> Float[AnyArray, "*#batch"]:
        """The expected reward, in units of the reward scale; one amount may be of many states."""
        assert self.weights is not None  # of any law a decoder says no rewards
        distance = jnp.abs(apart(state, self.place(amount), self.fields, self.scales))
        if self.is_quantity:
            distance = length(distance)[..., None]
        return -jnp.sum(jax.nn.softplus(self.weights(amount)) * distance, axis=-1)

    def distance(
        self, state: Float[AnyArray, "*#batch field"], amount: Float[AnyArray, "*#batch amount"]
    ) -> Float[AnyArray, "*#batch"]:
        """How far a state is from the place, scaled."""
        return length(apart(state, self.place(amount), self.fields, self.scales))

    def place(self, amount: Float[AnyArray, "*batch amount"]) -> Float[AnyArray, "*batch field"]:
        """Where the fields would be brought, scaled; a heading is that of a vector."""
        said, columns, i = self.reference(amount), [], 0
        for field, scale in zip(self.fields, self.scales, strict=True):
            is_heading = field in CIRCULAR
            columns.append(jnp.arctan2(said[..., i], said[..., i + 1]) / scale if is_heading else said[..., i])
            i += 2 if is_heading else 1
        return jnp.stack(columns, axis=-1)

    def doubt(self, amount: Belief) -> Float[AnyArray, "*batch field"]:
        """Variance of that place, scaled; of a heading to first order."""
        said, weights = self.reference(amount.mean), self.reference.weights[0]
        spread = amount.variance @ weights**2
        columns, i = [], 0
        for field, scale in zip(self.fields, self.scales, strict=True):
            if field in CIRCULAR:
                sine, cosine = said[..., i, None], said[..., i + 1, None]
                across = cosine * weights[:, i] - sine * weights[:, i + 1]  # both hang on the same amounts
                turn = across / jnp.maximum(sine**2 + cosine**2, 1e-6) / scale
                columns.append(jnp.sum(amount.variance * turn**2, axis=-1))
                i += 1
            else:
                columns.append(spread[..., i])
            i += 1
        return jnp.stack(columns, axis=-1)


class Decoder(eqx.Module):
    """p(next state, reward | state, action, z) = p(next state | state, action, z) p(reward | next state, z).

    The chain rule lets the reward head see the next state itself, which a gait or a noise may have moved
    away from its prediction. The state head sees z but does not shape it: dynamics must not get into a
    latent that is to be reused on other bodies (thesis chapter 4).

    The reward is a weighted distance from a point that is linear in z: all that tasks of the kind "bring this
    to there" need. So targets lie along straight lines of the latent and read out sharply, where an MLP in
    this place curls them up.

    Where z is split, its first dimensions say *what* is to be brought there, the others *how much*. Each family has an
    expert that is paid for its quantity alone, and *what* says how likely each is the one. Their rewards are not added
    up: a blend of two would pay, early on, where one is all there is to it, and get stuck there. Nor do experts share
    what says how much: one that has explained tasks of another kind would keep theirs from being right.
    """

    state_head: MLP
    experts: tuple[Expert, ...]
    log_variance: MLP | None
    """None for one that any law may be about: then it says distances, and no rewards."""
    choice: MLP | None
    kinds: int = eqx.field(static=True)
    fields: tuple[str, ...] = eqx.field(static=True)
    scales: tuple[float, ...] = eqx.field(static=True)

    def __init__(
        self,
        families: FamilySet,
        fields: tuple[str, ...],
        scales: tuple[float, ...],
        actions: int,
        latent: int,
        kinds: int,
        units: int,
        hears_any_law: bool = False,
        *,
        key: PRNGKeyArray,
    ):
        keys = jax.random.split(key, 4)
        self.kinds, self.fields, self.scales = kinds, fields, scales
        inputs = inputs_of(fields)
        self.state_head = MLP(inputs + actions + latent, len(fields), (units, units), key=keys[0])
        read = [family.quantity.components for family in families] if kinds else [fields]
        expert_keys = jax.vmap(jax.random.split)(jax.random.split(keys[1], len(read))) if kinds else keys[None, 1:3]
        scale_of = dict(zip(fields, scales, strict=True))
        self.experts = tuple(
            Expert(
                own,
                tuple(scale_of[f] for f in own),
                (latent - kinds) // len(read),
                units,
                bool(kinds),
                hears_any_law,
                keys=two,
            )
            for own, two in zip(read, expert_keys, strict=True)
        )
        self.log_variance = None if hears_any_law else MLP(inputs + latent, 1, (units, units), key=keys[3])
        self.choice = MLP(kinds, len(read), (), key=jax.random.fold_in(key, 4)) if kinds else None

    @property
    def hears_any_law(self) -> bool:
        """Whether rewards may be paid by any law."""
        return self.log_variance is None

    def next_state(
        self,
        state: Float[AnyArray, "*batch field"],
        action: Float[AnyArray, "*batch action"],
        latent: Float[AnyArray, "*batch latent"],
    ) -> Float[AnyArray, "*batch field"]:
        """Predicted fields of the next state, scaled as the encoder's."""
        inputs = [seen(state, self.fields, self.scales), action, jax.lax.stop_gradient(latent)]
        return state + self.state_head(jnp.concatenate(inputs, axis=-1))

    def reward(
        self, next_state: Float[AnyArray, "*batch field"], latent: Float[AnyArray, "*batch latent"]
    ) -> Prediction:
        """The reward's prediction, in units of the reward scale; one expert where z is not split."""
        assert self.log_variance is not None
        own = zip(self.experts, self.amounts(latent[..., self.kinds :]), strict=True)
        mean = jnp.stack([expert(self.read(expert, next_state), amounts) for expert, amounts in own], axis=-1)
        inputs = jnp.concatenate([seen(next_state, self.fields, self.scales), latent], axis=-1)
        return Prediction(mean, self.log_shares(latent), jnp.clip(self.log_variance(inputs)[..., 0], -12.0, 4.0))

    def distances(
        self, next_state: Float[AnyArray, "*#batch field"], latent: Float[AnyArray, "*#batch latent"]
    ) -> Float[AnyArray, "*#batch expert"]:
        """How far a state is from each expert's place, scaled."""
        own = zip(self.experts, self.amounts(latent[..., self.kinds :]), strict=True)
        return jnp.stack([each.distance(self.read(each, next_state), amounts) for each, amounts in own], axis=-1)

    def log_shares(self, latent: Float[AnyArray, "*batch latent"]) -> Float[AnyArray, "*batch expert"]:
        """Log-probability of each expert."""
        if self.choice is None:
            return jnp.zeros((*latent.shape[:-1], len(self.experts)))
        return jax.nn.log_softmax(self.choice(latent[..., : self.kinds]), axis=-1)

    def interpret(self, belief: Belief) -> Belief:
        """A belief in the decoder's own terms: how likely each family is meant, then where it is to be brought.

        So a policy need not learn what the latent's axes mean while they still move. Means and variances
        [*batch, family + number]; a belief that is not split says what it says, [*batch, latent].
        """
        if self.choice is None:
            return belief
        kind, amount = split(belief, self.kinds)
        # what a softmax of a Gaussian is on average (MacKay 1992)
        spread = jnp.einsum("...k,kf->...f", kind.variance, self.choice.weights[0] ** 2)
        share = jax.nn.softmax(self.choice(kind.mean) / jnp.sqrt(1 + jnp.pi / 8 * spread), axis=-1)
        of_each = zip(self.experts, self.amounts(amount.mean), self.amounts(amount.variance), strict=True)
        doubt = [expert.doubt(Belief(mean, variance)) for expert, mean, variance in of_each]
        return Belief(
            jnp.concatenate([share, self.places(amount.mean)], axis=-1),
            jnp.concatenate([jnp.zeros_like(share), *doubt], axis=-1),
        )

    def places(self, amount: Float[AnyArray, "*batch amount"]) -> Float[AnyArray, "*batch number"]:
        """Where each family's quantity would be brought, scaled as the encoder's fields."""
        own = zip(self.experts, self.amounts(amount), strict=True)
        return jnp.concatenate([expert.place(amounts) for expert, amounts in own], axis=-1)

    def amounts(self, amounts: Float[AnyArray, "*batch amount"]) -> Sequence[Float[AnyArray, "*batch own"]]:
        """What each expert goes by."""
        return jnp.split(amounts, len(self.experts), axis=-1)

    def read(self, expert: Expert, state: Float[AnyArray, "*batch field"]) -> Float[AnyArray, "*batch own"]:
        """The fields that an expert is about."""
        return state[..., np.array([self.fields.index(field) for field in expert.fields])]
