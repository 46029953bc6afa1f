"""The decoder: (state, action, latent) -> (next state, reward), used in training only."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

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
    up: a blend of two fields would pay, early on, where one field is all there is to it, and get stuck there.
    """

    state_head: MLP
    reference: MLP
    weights: MLP
    log_variance: MLP
    choice: MLP | None
    kinds: int = eqx.field(static=True)

    def __init__(self, fields: int, actions: int, latent: int, kinds: int, units: int, *, key: PRNGKeyArray):
        keys = jax.random.split(key, 4)
        amounts = latent - kinds
        self.kinds = kinds
        self.state_head = MLP(fields + actions + latent, fields, (units, units), key=keys[0])
        self.reference = MLP(amounts, fields, (), key=keys[1])
        self.weights = MLP(amounts, 1 if kinds else fields, (units,), key=keys[2])
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
        costs = jax.nn.softplus(self.weights(amount)) * jnp.abs(next_state - self.reference(amount))
        mean = -costs if self.kinds else -jnp.sum(costs, axis=-1, keepdims=True)
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
        doubt = jnp.einsum("...a,af->...f", amount.variance, self.reference.weights[0] ** 2)
        return Belief(
            jnp.concatenate([share, self.reference(amount.mean)], axis=-1),
            jnp.concatenate([jnp.zeros_like(share), doubt], axis=-1),
        )
