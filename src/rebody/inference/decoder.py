"""The decoder: (state, action, latent) -> (next state, reward), used in training only."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Float, PRNGKeyArray

from rebody.nn import MLP
from rebody.types import AnyArray


class Gaussian(eqx.Module):
    """Mean and log-variance of a prediction."""

    mean: Float[AnyArray, "*batch"]
    log_variance: Float[AnyArray, "*batch"]


class Decoder(eqx.Module):
    """p(next state, reward | state, action, z) = p(next state | state, action, z) p(reward | next state, z).

    The chain rule lets the reward head see the next state itself, which a gait or a noise may have moved
    away from its prediction. The state head sees z but does not shape it: dynamics must not get into a
    latent that is to be reused on other bodies (thesis chapter 4).

    The reward is a weighted distance from a point that is linear in z: all that tasks of the kind "bring this
    to there" need. So targets lie along straight lines of the latent and read out sharply, where an MLP in
    this place curls them up.

    Where z is split, its first dimensions say *what* is to be brought there: they alone share the weight out
    among the fields, and all else of the reward comes from the others, which say *how much*.
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

    def reward(self, next_state: Float[AnyArray, "*batch field"], latent: Float[AnyArray, "*batch latent"]) -> Gaussian:
        """Predicted reward, in units of the reward scale, and how sure the decoder is of it."""
        kind, amount = latent[..., : self.kinds], latent[..., self.kinds :]
        weights = jax.nn.softplus(self.weights(amount))
        if self.choice is not None:
            weights = weights * jax.nn.softmax(self.choice(kind), axis=-1)
        mean = -jnp.sum(weights * jnp.abs(next_state - self.reference(amount)), axis=-1)
        log_variance = self.log_variance(jnp.concatenate([next_state, latent], axis=-1))[..., 0]
        return Gaussian(mean, jnp.clip(log_variance, -12.0, 4.0))
