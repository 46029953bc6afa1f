"""The inference module and its loss (thesis 5.3)."""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.errors import RebodyError
from rebody.inference.decoder import Decoder, Prediction
from rebody.inference.encoder import Encoder
from rebody.inference.inputs import apart, scaled
from rebody.inference.prior import Prior
from rebody.inference.profile import log_likelihoods
from rebody.nn import MLP
from rebody.ranges import Copies, Decisions, NotNegative, Number, Positive, Rate
from rebody.tasks import FamilySet
from rebody.types import AnyArray, GlobalState, Transition

FARTHEST_PLACE = 1.5
"""Experts are held to places within this, in units of their fields' scales. Beyond all that a body visits a distance is
next to constant: a cheap account of any task, which keeps an expert from ever finding the true place."""

OTHER_TASKS_PAY = 2.0
"""Rewards of a task that is not believed in may lie anywhere within this, in units of the reward scale."""


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
    hears_any_law: bool = False
    """Whether rewards may be paid by any law, in any scale and with any bonus: then the encoder normalises them, and
    what is learned is how well distances from a place explain them. It needs a split latent."""

    @property
    def clustered(self) -> int:
        """Dimensions of the latent that a mixture clusters: those that say what kind of task it is."""
        return self.kinds or self.latent

    def check(self, families: FamilySet) -> None:
        """ValueError where the encoder does not see what families are about, or a split latent cannot be shared."""
        unseen = [name for family in families for name in family.quantity.components if name not in self.fields]
        if unseen and self.kinds:
            raise ValueError(f"inference.fields: {', '.join(self.fields)}, but families are about {unseen[0]} as well")
        if turning := [family.name for family in families if family.quantity.frame != "world"]:
            raise ValueError(
                f"families: '{turning[0]}' is told in the frame of the heading, which no module learns yet"
            )
        if self.hears_any_law and not self.kinds:
            raise ValueError("inference.hears-any-law needs a latent that is split: give inference.kinds")
        amounts = self.latent - self.kinds
        if self.kinds and (amounts < 1 or amounts % len(families)):
            raise ValueError(
                f"inference.latent: {self.latent} with {self.kinds} for the kind leaves {amounts}, which "
                f"{len(families)} families cannot share evenly"
            )


class InferenceModule(eqx.Module):
    """Encoder and decoder; frozen once trained."""

    encoder: Encoder
    decoder: Decoder
    labeller: MLP | None
    """Latent -> logits of the base tasks, where labels are used."""

    def __init__(self, config: InferenceConfig, families: FamilySet, actions: int, key: PRNGKeyArray):
        """`actions`: size of the toy's action, which only the decoder sees.

        RebodyError where the settings do not suit the families.
        """
        try:
            config.check(families)
        except ValueError as error:
            raise RebodyError(f"--{error}.") from None
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
            normalises=config.hears_any_law,
            key=encoder_key,
        )
        self.decoder = Decoder(
            families,
            config.fields,
            config.scales,
            actions,
            config.latent,
            config.kinds,
            config.units,
            config.hears_any_law,
            key=decoder_key,
        )
        self.labeller = MLP(config.latent, families.base_tasks, (), key=label_key) if config.label_weight else None


class Evidence(eqx.Module):
    """Windows to encode, and transitions of the same episodes that the beliefs must explain."""

    window: Transition  # [batch, time]
    base_task: Int[AnyArray, "batch time"]  # only where labels are used
    changed: Float[AnyArray, "batch time decoded"]  # how likely the task has changed between belief and transition
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
    fields, scales = encoder.fields, encoder.scales
    before, after = (scaled(state, fields, scales) for state in (evidence.previous, evidence.state))

    # the state's prediction does not shape the latent, so one belief of a window is enough
    last = jnp.broadcast_to(latent[:, -1:], (*before.shape[:2], config.latent))
    predicted_state = decoder.next_state(before, evidence.action, last)
    state_error = jnp.mean(apart(predicted_state, after, fields, scales) ** 2)

    learned = _unexplained_by_any_law if config.hears_any_law else _unexplained
    reward_loss, reward_error = learned(module, latent, after, evidence)
    reconstruction = reward_loss + config.state_weight * state_error
    if config.kinds:
        excess = jnp.maximum(jnp.abs(decoder.places(latent[..., config.kinds :])) - FARTHEST_PLACE, 0.0)
        reconstruction = reconstruction + jnp.mean(excess**2)
    if module.labeller is not None:
        labels = optax.softmax_cross_entropy_with_integer_labels(module.labeller(latent), evidence.base_task)
        reconstruction = reconstruction + config.label_weight * jnp.mean(labels)
    kl = jnp.mean(prior(belief))
    metrics = {
        "reward_error": reward_error,
        "state_error": jnp.sqrt(state_error),
        "kl": kl,
    }
    return reconstruction + config.kl_weight * kl, metrics


def _unexplained(
    module: InferenceModule,
    latent: Float[AnyArray, "batch time latent"],
    after: Float[AnyArray, "batch decoded field"],
    evidence: Evidence,
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The rewards' share of the loss, and the error of their prediction in the reward's unit."""
    decoder, scale = module.decoder, module.encoder.reward_scale
    shape = (*latent.shape[:2], after.shape[1])
    latents = jnp.broadcast_to(latent[:, :, None], (*shape, latent.shape[-1]))
    predicted = decoder.reward(jnp.broadcast_to(after[:, None], (*shape, after.shape[-1])), latents)
    wanted = jnp.broadcast_to(evidence.reward[:, None] / scale, shape)
    own, loss_of_each = _explained(wanted, predicted, evidence.changed)
    error = jnp.sum(own * (wanted - predicted.expectation) ** 2) / jnp.maximum(jnp.sum(own), 1e-6)
    return jnp.mean(loss_of_each), jnp.sqrt(error) * scale


def _unexplained_by_any_law(
    module: InferenceModule,
    latent: Float[AnyArray, "batch time latent"],
    after: Float[AnyArray, "batch decoded field"],
    evidence: Evidence,
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The same where units are unknown: by the laws that suit the rewards best, of the experts that are believed in.
    The error is in units of the rewards' spread."""
    decoder = module.decoder
    distances = jnp.moveaxis(decoder.distances(after[:, None], latent[:, :, None]), -1, -2)
    weight = (1 - evidence.changed)[:, :, None]
    likely = log_likelihoods(distances, evidence.reward[:, None, None], weight)  # [batch, time, expert, law]
    count = jnp.sum(weight, axis=-1, keepdims=True)
    share = decoder.log_shares(latent)[..., None] - jnp.log(likely.shape[-1])
    loss = -jax.nn.logsumexp(share + count * likely, axis=(-2, -1)) / jnp.maximum(count[..., 0, 0], 1.0)
    return jnp.mean(loss), jnp.mean(jnp.exp(-jnp.max(likely, axis=(-2, -1))))


def _explained(
    wanted: Float[Array, "*batch"], predicted: Prediction, changed: Float[AnyArray, "*batch"]
) -> tuple[Float[Array, "*batch"], Float[Array, "*batch"]]:
    """How likely each reward is of the believed task, and its weighted negative log-likelihood.

    Nobody says when tasks change: a reward that lies far off in time may be another task's, which pays anything. The
    likelihood decides which it is.

    Sigma is learned in place of the constant of thesis (5.2). A constant lets the first decisions of an episode, when
    nothing can be known, rule the loss; weighting by sigma (beta-NLL, Seitzer et al. 2022, beta = 1/2) keeps the
    gradient of the sure ones in bounds.
    """
    sigma = jnp.exp(0.5 * predicted.log_variance)
    own = jnp.log1p(-changed) + predicted.log_likelihood(wanted) - 0.5 * jnp.log(2 * jnp.pi)
    other = jnp.log(changed) - jnp.log(OTHER_TASKS_PAY)
    either = jnp.logaddexp(own, other)
    return jax.lax.stop_gradient(jnp.exp(own - either)), -jax.lax.stop_gradient(sigma) * either
