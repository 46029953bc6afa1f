"""The inference module and its loss (thesis 5.3)."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from rebody.inference.decoder import Decoder
from rebody.inference.encoder import Encoder
from rebody.inference.prior import Prior
from rebody.types import AnyArray, GlobalState, Transition


@dataclass(frozen=True)
class InferenceConfig:
    """Sizes and loss weights of an inference module."""

    fields: tuple[str, ...] = ("x",)
    """Fields of the global state that the encoder sees; a field constant on the toy must not be among them."""
    scales: tuple[float, ...] = (10.0,)
    """What each field is divided by [m, rad, m/s]."""
    reward_scale: float = 10.0
    """What the reward is divided by."""
    window: int = 32
    """Transitions that a belief rests on."""
    latent: int = 2
    """Dimensions of the latent."""
    units: int = 64
    """Size of the recurrent state and of the hidden layers."""
    state_weight: float = 0.1
    """Weight of the next state's squared error (thesis 5.5)."""
    kl_weight: float = 1e-4
    """beta of thesis (5.7)."""
    learning_rate: float = 2e-3
    """Adam's step size at the start; a cosine takes it to a twentieth."""
    batch_size: int = 32
    """Windows of one update."""
    decoded: int = 8
    """Transitions of the same episode that each belief must explain."""


class InferenceModule(eqx.Module):
    """Encoder and decoder; frozen once trained."""

    encoder: Encoder
    decoder: Decoder

    def __init__(self, config: InferenceConfig, actions: int, key: PRNGKeyArray):
        """`actions`: size of the toy's action, which only the decoder sees."""
        encoder_key, decoder_key = jax.random.split(key)
        self.encoder = Encoder(
            fields=config.fields,
            scales=config.scales,
            reward_scale=config.reward_scale,
            window=config.window,
            latent=config.latent,
            units=config.units,
            key=encoder_key,
        )
        self.decoder = Decoder(len(config.fields), actions, config.latent, config.units, key=decoder_key)


class Evidence(eqx.Module):
    """Windows to encode, and transitions of the same episodes that the beliefs must explain."""

    window: Transition  # [batch, time]
    previous: GlobalState  # [batch, decoded]
    action: Float[AnyArray, "batch decoded action"]
    reward: Float[AnyArray, "batch decoded"]
    state: GlobalState  # [batch, decoded]


def loss(
    module: InferenceModule, evidence: Evidence, prior: Prior, config: InferenceConfig, key: PRNGKeyArray
) -> tuple[Float[Array, ""], dict[str, Float[Array, ""]]]:
    """Negative ELBO (thesis 5.1-5.7), averaged over windows and over the beliefs along each window."""
    encoder, decoder = module.encoder, module.decoder
    belief = encoder.along(evidence.window)
    noise = jax.random.normal(key, belief.mean.shape)
    latent = belief.mean + jnp.sqrt(belief.variance) * noise  # [batch, time, latent]
    shape = (*latent.shape[:2], config.decoded)
    latent = jnp.broadcast_to(latent[:, :, None], (*shape, config.latent))

    scales = jnp.asarray(encoder.scales)
    before = _beside(evidence.previous.select(encoder.fields) / scales, shape)
    after = _beside(evidence.state.select(encoder.fields) / scales, shape)
    predicted_state = decoder.next_state(before, _beside(evidence.action, shape), latent)
    state_error = jnp.mean((predicted_state - after) ** 2)

    predicted = decoder.reward(after, latent)
    wanted = evidence.reward[:, None] / encoder.reward_scale
    reward_loss = jnp.mean(_weighted_negative_log_likelihood(wanted, predicted))
    reward_error = jnp.mean((wanted - predicted.mean) ** 2)

    reconstruction = reward_loss + config.state_weight * state_error
    kl = jnp.mean(prior(belief))
    metrics = {
        "reward_error": jnp.sqrt(reward_error) * encoder.reward_scale,
        "state_error": jnp.sqrt(state_error),
        "kl": kl,
    }
    return reconstruction + config.kl_weight * kl, metrics


def _beside(x: Float[AnyArray, "batch decoded n"], shape: tuple[int, ...]) -> Float[AnyArray, "batch time decoded n"]:
    return jnp.broadcast_to(x[:, None], (*shape, x.shape[-1]))


def _weighted_negative_log_likelihood(wanted, predicted):
    """Gaussian likelihood with a learned sigma in place of the constant of thesis (5.2).

    A constant lets the first decisions of an episode, when nothing can be known, rule the loss; weighting
    by sigma (beta-NLL, Seitzer et al. 2022, beta = 1/2) keeps the gradient of the sure ones in bounds.
    """
    squared = (wanted - predicted.mean) ** 2
    negative_log_likelihood = 0.5 * (squared * jnp.exp(-predicted.log_variance) + predicted.log_variance)
    return jax.lax.stop_gradient(jnp.exp(0.5 * predicted.log_variance)) * negative_log_likelihood
