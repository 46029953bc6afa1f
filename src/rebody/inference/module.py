"""The inference module and its loss (thesis 5.3)."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from rebody.errors import RebodyError
from rebody.inference.decoder import Decoder
from rebody.inference.encoder import Encoder
from rebody.inference.prior import Prior
from rebody.nn import MLP
from rebody.ranges import Copies, Decisions, NotNegative, Number, Positive, Rate
from rebody.tasks import FAMILIES
from rebody.types import AnyArray, GlobalState, Transition

BASE_TASKS = 2 * len(FAMILIES)
"""Family x sign."""
FARTHEST_PLACE = 1.5
"""Experts are held to places within this, in units of their fields' scales. Beyond all that a body visits a distance is
next to constant: a cheap account of any task, which keeps an expert from ever finding the true place."""


@dataclass(frozen=True)
class InferenceConfig:
    """Sizes and loss weights of an inference module."""

    fields: tuple[str, ...] = ("x",)
    """Fields of the global state that the encoder sees; a field constant on the toy must not be among them."""
    scales: tuple[Positive, ...] = (10.0,)
    """What each field is divided by [m, rad, m/s]."""
    reward_scale: Positive = 10.0
    """What the reward is divided by."""
    window: Decisions | None = 32
    """Transitions that a belief rests on; None for all since the episode began (a carried state)."""
    latent: Copies = 2
    """Dimensions of the latent."""
    kinds: Number = 0
    """Dimensions of the latent, the first, that say what kind of task it is; the others say how much is asked.
    0 for a latent that is not split."""
    units: Copies = 64
    """Size of the recurrent state and of the hidden layers."""
    state_weight: NotNegative = 0.1
    """Weight of the next state's squared error (thesis 5.5)."""
    kl_weight: NotNegative = 1e-4
    """beta of thesis (5.7)."""
    kind_weight: NotNegative = 100.0
    """Weight of the kinds' share of the divergence, relative to the rest of a split latent."""
    label_weight: NotNegative = 0.0
    """Weight of the cross-entropy on the true base task, as the ancestors had it (0.05); 0 is label-free."""
    learning_rate: Rate = 2e-3
    """Adam's step size at the start; a cosine takes it to a twentieth."""
    batch_size: Copies = 32
    """Windows of one update."""
    decoded: Copies = 8
    """Transitions of the same episode that each belief must explain."""

    @property
    def clustered(self) -> int:
        """Dimensions of the latent that a mixture clusters: those that say what kind of task it is."""
        return self.kinds or self.latent

    @property
    def places(self) -> tuple[tuple[str, float], ...]:
        """Fields that a split latent says the places of (`Decoder.interpret`), and their scales; else none."""
        return tuple(zip(self.fields, self.scales, strict=True)) if self.kinds else ()


class InferenceModule(eqx.Module):
    """Encoder and decoder; frozen once trained."""

    encoder: Encoder
    decoder: Decoder
    labeller: MLP | None
    """Latent -> logits of the base tasks, where labels are used."""

    def __init__(self, config: InferenceConfig, actions: int, key: PRNGKeyArray):
        """`actions`: size of the toy's action, which only the decoder sees.

        RebodyError if a split latent has not as many amounts for each field.
        """
        if config.kinds and (config.latent - config.kinds) % len(config.fields):
            raise RebodyError(
                f"a latent of {config.latent} with {config.kinds} for the kind leaves {config.latent - config.kinds}, "
                f"which {len(config.fields)} fields cannot share evenly. Choose another --inference.latent."
            )
        encoder_key, decoder_key = jax.random.split(key)
        label_key = jax.random.fold_in(key, 2)
        self.encoder = Encoder(
            fields=config.fields,
            scales=config.scales,
            reward_scale=config.reward_scale,
            window=config.window,
            latent=config.latent,
            kinds=config.kinds,
            units=config.units,
            key=encoder_key,
        )
        self.decoder = Decoder(len(config.fields), actions, config.latent, config.kinds, config.units, key=decoder_key)
        self.labeller = MLP(config.latent, BASE_TASKS, (), key=label_key) if config.label_weight else None


class Evidence(eqx.Module):
    """Windows to encode, and transitions of the same episodes that the beliefs must explain."""

    window: Transition  # [batch, time]
    base_task: Int[AnyArray, "batch time"]  # only where labels are used
    same_task: Bool[AnyArray, "batch time decoded"]  # whether the task of the belief was on in the transition
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
    scales = jnp.asarray(encoder.scales)
    before = evidence.previous.select(encoder.fields) / scales
    after = evidence.state.select(encoder.fields) / scales

    # the state's prediction does not shape the latent, so one belief of a window is enough
    last = jnp.broadcast_to(latent[:, -1:], (*before.shape[:2], config.latent))
    state_error = jnp.mean((decoder.next_state(before, evidence.action, last) - after) ** 2)

    shape = (*latent.shape[:2], config.decoded)
    latents = jnp.broadcast_to(latent[:, :, None], (*shape, config.latent))
    predicted = decoder.reward(jnp.broadcast_to(after[:, None], (*shape, after.shape[-1])), latents)
    wanted = jnp.broadcast_to(evidence.reward[:, None] / encoder.reward_scale, shape)
    share = evidence.same_task / jnp.maximum(jnp.sum(evidence.same_task), 1)
    reward_loss = jnp.sum(share * _weighted_negative_log_likelihood(wanted, predicted))
    reward_error = jnp.sum(share * (wanted - predicted.expectation) ** 2)

    reconstruction = reward_loss + config.state_weight * state_error
    if config.kinds:
        excess = jnp.maximum(jnp.abs(decoder.places(latent[..., config.kinds :])) - FARTHEST_PLACE, 0.0)
        reconstruction = reconstruction + jnp.mean(excess**2)
    if module.labeller is not None:
        labels = optax.softmax_cross_entropy_with_integer_labels(module.labeller(latent), evidence.base_task)
        reconstruction = reconstruction + config.label_weight * jnp.mean(labels)
    kl = jnp.mean(prior(belief))
    metrics = {
        "reward_error": jnp.sqrt(reward_error) * encoder.reward_scale,
        "state_error": jnp.sqrt(state_error),
        "kl": kl,
    }
    return reconstruction + config.kl_weight * kl, metrics


def _weighted_negative_log_likelihood(wanted, predicted):
    """Likelihood with a learned sigma in place of the constant of thesis (5.2).

    A constant lets the first decisions of an episode, when nothing can be known, rule the loss; weighting
    by sigma (beta-NLL, Seitzer et al. 2022, beta = 1/2) keeps the gradient of the sure ones in bounds.
    """
    sigma = jnp.exp(0.5 * predicted.log_variance)
    return -jax.lax.stop_gradient(sigma) * predicted.log_likelihood(wanted)
