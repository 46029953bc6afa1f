"""The decoder: (state, action, latent) -> (next state, reward), used in training only."""

from collections.abc import Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, Key, PRNGKeyArray

from rebody.inference.prior import split
from rebody.nn import MLP
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
    """Reads a reward as a weighted distance of some fields from a point that is linear in an amount."""

    reference: MLP
    weights: MLP

    def __init__(self, fields: int, amounts: int, units: int, *, keys: Key[AnyArray, "2"]):
        self.reference = MLP(amounts, fields, (), key=keys[0])
        self.weights = MLP(amounts, fields, (units,), key=keys[1])

    def __call__(
        self, state: Float[AnyArray, "*batch field"], amount: Float[AnyArray, "*batch amount"]
    ) -> Float[AnyArray, "*batch"]:
        """The expected reward, in units of the reward scale."""
        costs = jax.nn.softplus(self.weights(amount)) * jnp.abs(state - self.reference(amount))
        return -jnp.sum(costs, axis=-1)


class Decoder(eqx.Module):
    """p(next state, reward | state, action, z) = p(next state | state, action, z) p(reward | next state, z).

    The chain rule lets the reward head see the next state itself, which a gait or a noise may have moved
    away from its prediction. The state head sees z but does not shape it: dynamics must not get into a
    latent that is to be reused on other bodies (thesis chapter 4).

    The reward is a weighted distance from a point that is linear in z: all that tasks of the kind "bring this
    to there" need. So targets lie along straight lines of the latent and read out sharply, where an MLP in
    this place curls them up.

    Where z is split, its first dimensions say *what* is to be brought there, the others *how much*. Each field has an
    expert that is paid for that field alone, and *what* says how likely each is the one. Their rewards are not added
    up: a blend of two fields would pay, early on, where one field is all there is to it, and get stuck there. Nor do
    experts share what says how much: one that has explained tasks of another kind would keep theirs from being right.
    """

    state_head: MLP
    experts: tuple[Expert, ...]
    log_variance: MLP
    choice: MLP | None
    kinds: int = eqx.field(static=True)

    def __init__(self, fields: int, actions: int, latent: int, kinds: int, units: int, *, key: PRNGKeyArray):
        keys = jax.random.split(key, 4)
        self.kinds = kinds
        self.state_head = MLP(fields + actions + latent, fields, (units, units), key=keys[0])
        experts = fields if kinds else 1
        expert_keys = jax.vmap(jax.random.split)(jax.random.split(keys[1], experts)) if kinds else keys[None, 1:3]
        self.experts = tuple(
            Expert(fields // experts, (latent - kinds) // experts, units, keys=two) for two in expert_keys
        )
        self.log_variance = MLP(fields + latent, 1, (units, units), key=keys[3])
        self.choice = MLP(kinds, fields, (), key=jax.random.fold_in(key, 4)) if kinds else None

    def next_state(
        self,
        state: Float[AnyArray, "*batch field"],
        action: Float[AnyArray, "*batch action"],
        latent: Float[AnyArray, "*batch latent"],
    ) -> Float[AnyArray, "*batch field"]:
        """Predicted fields of the next state, scaled as the encoder's."""
        inputs = jnp.concatenate([state, action, jax.lax.stop_gradient(latent)], axis=-1)
        return state + self.state_head(inputs)

    def reward(
        self, next_state: Float[AnyArray, "*batch field"], latent: Float[AnyArray, "*batch latent"]
    ) -> Prediction:
        """The reward's prediction, in units of the reward scale; one expert where z is not split."""
        kind, amount = latent[..., : self.kinds], latent[..., self.kinds :]
        of_each = zip(self.experts, self._split(next_state), self._split(amount), strict=True)
        mean = jnp.stack([expert(state, own) for expert, state, own in of_each], axis=-1)
        log_share = jax.nn.log_softmax(self.choice(kind), axis=-1) if self.choice else jnp.zeros_like(mean)
        log_variance = self.log_variance(jnp.concatenate([next_state, latent], axis=-1))[..., 0]
        return Prediction(mean, log_share, jnp.clip(log_variance, -12.0, 4.0))

    def interpret(self, belief: Belief) -> Belief:
        """A belief in the decoder's own terms: how likely each field is meant, then where it is to be brought.

        So a policy need not learn what the latent's axes mean while they still move. Means and variances
        [*batch, 2 field]; a belief that is not split says what it says, [*batch, latent].
        """
        if self.choice is None:
            return belief
        kind, amount = split(belief, self.kinds)
        # what a softmax of a Gaussian is on average (MacKay 1992)
        spread = jnp.einsum("...k,kf->...f", kind.variance, self.choice.weights[0] ** 2)
        share = jax.nn.softmax(self.choice(kind.mean) / jnp.sqrt(1 + jnp.pi / 8 * spread), axis=-1)
        variances = zip(self.experts, self._split(amount.variance), strict=True)
        doubt = [variance @ expert.reference.weights[0] ** 2 for expert, variance in variances]
        return Belief(
            jnp.concatenate([share, self.places(amount.mean)], axis=-1),
            jnp.concatenate([jnp.zeros_like(share), *doubt], axis=-1),
        )

    def places(self, amount: Float[AnyArray, "*batch amount"]) -> Float[AnyArray, "*batch field"]:
        """Where each field would be brought, scaled as the encoder's."""
        of_each = zip(self.experts, self._split(amount), strict=True)
        return jnp.concatenate([expert.reference(own) for expert, own in of_each], axis=-1)

    def _split(self, features: Float[AnyArray, "*batch feature"]) -> Sequence[Float[AnyArray, "*batch own"]]:
        """What each expert sees of them."""
        return jnp.split(features, len(self.experts), axis=-1)
