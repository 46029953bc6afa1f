"""Soft actor-critic (thesis 2.14-2.17; Haarnoja et al. 2018), one implementation for every policy.

State in, state out: `update(state, batch, key, config) -> (state, metrics)`. Twin critics with
layer normalisation, a learned temperature, and a slowly averaged actor for evaluation.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Float, Key, PRNGKeyArray

from rebody.errors import RebodyError
from rebody.nn import MLP, MultiScale
from rebody.ranges import Copies, Finite, Layers, Number, Positive, Rate, Share, Updates
from rebody.types import AnyArray, Tree

LOG_STD_RANGE = (-5.0, 1.0)


@dataclass(frozen=True)
class SACConfig:
    """Hyperparameters of soft actor-critic."""

    hidden: Layers = (256, 256)
    """Units of each hidden layer of actor and critics."""
    projections: Number = 0
    """Learned differences of the inputs that the networks see at several sharpnesses; 0 for none."""
    learning_rate: Rate = 3e-4
    """Adam's step size for actor and critics at the start."""
    final_learning_rate: Rate = 3e-5
    """Step size that a cosine reaches after `decay_updates`: small steps make precise policies."""
    decay_updates: Updates = 100_000
    """Updates over which the step size falls."""
    discount: Share = 0.98
    """Discount per step."""
    target_rate: Rate = 0.005
    """Share of the new critic in the target critic at each update (tau)."""
    average_rate: Rate = 0.002
    """Share of the new actor in the averaged one."""
    target_entropy: Finite = -1.0
    """Wanted entropy [nats] per action dimension, of the action before its bounds are scaled."""
    initial_temperature: Positive = 0.1
    """Temperature alpha at the start; learned from there."""
    batch_size: Copies = 256
    """Transitions of one update."""
    huber: Positive = 100.0
    """Bellman errors beyond this count linearly. Where a hidden task makes early values uncertain by metres,
    it keeps them from drowning the centimetres."""


class SACBatch(eqx.Module):
    """Transitions; `terminal` is 1 where the episode truly ended (no value beyond)."""

    observation: Float[AnyArray, "batch observation"]
    action: Float[AnyArray, "batch action"]  # in [-1, 1]
    reward: Float[AnyArray, " batch"]
    next_observation: Float[AnyArray, "batch observation"]
    terminal: Float[AnyArray, " batch"]


class Network(eqx.Module):
    """An MLP, behind a multi-scale input layer where wanted."""

    multi_scale: MultiScale | None
    mlp: MLP

    def __init__(self, inputs: int, outputs: int, config: SACConfig, *, key: PRNGKeyArray, **mlp_options):
        scale_key, mlp_key = jax.random.split(key)
        self.multi_scale = MultiScale(inputs, config.projections, key=scale_key) if config.projections else None
        seen = self.multi_scale.outputs if self.multi_scale else inputs
        self.mlp = MLP(seen, outputs, config.hidden, key=mlp_key, **mlp_options)

    def __call__(self, x: Float[AnyArray, "*batch inputs"]) -> Float[AnyArray, "*batch outputs"]:
        """The MLP's outputs."""
        return self.mlp(x if self.multi_scale is None else self.multi_scale(x))


class Actor(eqx.Module):
    """A tanh-squashed Gaussian policy: observation -> action in [-1, 1]."""

    net: Network
    observations: int = eqx.field(static=True)
    actions: int = eqx.field(static=True)

    def __init__(self, observations: int, actions: int, config: SACConfig, key: PRNGKeyArray):
        self.observations, self.actions = observations, actions
        self.net = Network(observations, 2 * actions, config, key=key, last_scale=0.1)

    def __call__(self, observation: Float[AnyArray, "*batch observation"]) -> Float[AnyArray, "*batch action"]:
        """The most likely action."""
        return jnp.tanh(self._gaussian(observation)[0])

    def sample(
        self, observation: Float[AnyArray, "*batch observation"], key: PRNGKeyArray
    ) -> tuple[Float[AnyArray, "*batch action"], Float[AnyArray, "*batch action"]]:
        """An action, and the log-probability density of each of its numbers [nats]."""
        mean, log_std = self._gaussian(observation)
        noise = jax.random.normal(key, mean.shape)
        raw = mean + jnp.exp(log_std) * noise
        gaussian = -0.5 * noise**2 - log_std - 0.5 * jnp.log(2 * jnp.pi)
        # ln(1 - tanh(u)^2), written so that it does not overflow
        squash = 2 * (jnp.log(2.0) - raw - jax.nn.softplus(-2 * raw))
        return jnp.tanh(raw), gaussian - squash

    def _gaussian(self, observation):
        mean, log_std = jnp.split(self.net(observation), 2, axis=-1)
        low, high = LOG_STD_RANGE
        return mean, low + 0.5 * (high - low) * (jnp.tanh(log_std) + 1)


class Critics(eqx.Module):
    """Two critics: (observation, action) -> value, stacked on the first axis."""

    first: Network
    second: Network

    def __init__(self, inputs: int, config: SACConfig, key: PRNGKeyArray):
        first_key, second_key = jax.random.split(key)
        self.first = Network(inputs, 1, config, key=first_key, layer_norm=True)
        self.second = Network(inputs, 1, config, key=second_key, layer_norm=True)

    def __call__(
        self, observation: Float[AnyArray, "*batch observation"], action: Float[AnyArray, "*batch action"]
    ) -> Float[AnyArray, "2 *batch"]:
        """The value that each critic gives."""
        x = jnp.concatenate([observation, action], axis=-1)
        return jnp.stack([self.first(x)[..., 0], self.second(x)[..., 0]])


ActionValue = Callable[
    [
        Critics,
        Float[AnyArray, "*batch observation"],
        Float[AnyArray, "*batch action"],
        Float[AnyArray, "*batch action"],
    ],
    tuple[Float[AnyArray, "*batch"], Float[AnyArray, "*batch"]],
]
"""(critics, observation, action, log-probability of each of its numbers) -> what is done in the end: its value to the
more doubtful critic, and its log-probability."""


def value_of_action(
    critics: Critics,
    observation: Float[AnyArray, "*batch observation"],
    action: Float[AnyArray, "*batch action"],
    log_probs: Float[AnyArray, "*batch action"],
) -> tuple[Float[AnyArray, "*batch"], Float[AnyArray, "*batch"]]:
    """The action value of an actor whose action is done as it is."""
    return critics(observation, action).min(0), log_probs.sum(-1)


class SACState(eqx.Module):
    """Everything an update reads and writes."""

    actor: Actor
    averaged_actor: Actor
    critics: Critics
    target_critics: Critics
    log_temperature: Float[AnyArray, ""]
    actor_optimiser: optax.OptState
    critic_optimiser: optax.OptState
    temperature_optimiser: optax.OptState


def initial_state(observations: int, actions: int, config: SACConfig, key: PRNGKeyArray) -> SACState:
    """A fresh policy for observation and action vectors of the given sizes."""
    actor_key, critic_key = jax.random.split(key)
    actor = Actor(observations, actions, config, actor_key)
    critics = Critics(observations + actions, config, critic_key)
    log_temperature = jnp.log(jnp.asarray(config.initial_temperature, jnp.float32))
    optimiser = _optimiser(config)
    return SACState(
        actor=actor,
        averaged_actor=actor,
        critics=critics,
        target_critics=critics,
        log_temperature=log_temperature,
        actor_optimiser=optimiser.init(eqx.filter(actor, eqx.is_array)),
        critic_optimiser=optimiser.init(eqx.filter(critics, eqx.is_array)),
        temperature_optimiser=optimiser.init(log_temperature),
    )


def update(
    state: SACState, batch: SACBatch, key: PRNGKeyArray, config: SACConfig, action_value: ActionValue = value_of_action
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """One step of critics, actor and temperature, then of the two moving averages.

    With another `action_value` an actor may say more than what is done in the end, which is what `batch.action` holds.
    """
    critic_key, actor_key = jax.random.split(key)
    state, critic_metrics = _update_critics(state, batch, critic_key, config, action_value)
    state, actor_metrics = _update_actor(state, batch, actor_key, config, action_value)
    state, temperature_metrics = _update_temperature(state, actor_metrics["entropy"], batch, config)
    state = _update_averages(state, config)
    return state, critic_metrics | actor_metrics | temperature_metrics


def update_many(
    state: SACState,
    batch_of: Callable[[Any, PRNGKeyArray], SACBatch],
    inputs: Any,
    keys: Key[AnyArray, " update"],
    config: SACConfig,
    action_value: ActionValue = value_of_action,
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """An update per key in one scan; `batch_of` makes its batch from one entry of `inputs` and a key.

    Returns the mean of each metric.
    """
    arrays, static = eqx.partition(state, eqx.is_array)

    def step(arrays, inputs):
        inputs, key = inputs
        batch_key, update_key = jax.random.split(key)
        updated, metrics = update(
            eqx.combine(arrays, static), batch_of(inputs, batch_key), update_key, config, action_value
        )
        return eqx.filter(updated, eqx.is_array), metrics

    arrays, metrics = jax.lax.scan(step, arrays, (inputs, keys))
    return eqx.combine(arrays, static), jax.tree.map(jnp.mean, metrics)


def take_over(state: SACState, actor: Actor, name: str) -> SACState:
    """The state with a trained actor in place of its own; RebodyError if its sizes differ."""
    if jax.tree.map(jnp.shape, actor) != jax.tree.map(jnp.shape, state.actor):
        raise RebodyError(f"cannot start from '{name}': its networks have other sizes than these settings.")
    return eqx.tree_at(lambda s: (s.actor, s.averaged_actor), state, (actor, actor))


def _update_critics(state, batch, key, config, action_value):
    """Soft Bellman error against the smaller of the two target critics (thesis 2.14, 2.15)."""
    sampled = state.actor.sample(batch.next_observation, key)
    next_value, next_log_prob = action_value(state.target_critics, batch.next_observation, *sampled)
    next_value = next_value - jnp.exp(state.log_temperature) * next_log_prob
    target = batch.reward + config.discount * (1 - batch.terminal) * next_value

    def loss(critics):
        values = critics(batch.observation, batch.action)
        return 2 * jnp.mean(optax.huber_loss(values, target[None], delta=config.huber)), values

    (value, values), gradient = eqx.filter_value_and_grad(loss, has_aux=True)(state.critics)
    critics, optimiser = _apply(gradient, state.critics, state.critic_optimiser, config)
    state = eqx.tree_at(lambda s: (s.critics, s.critic_optimiser), state, (critics, optimiser))
    return state, {"critic_loss": value, "value": values.mean()}


def _update_actor(state, batch, key, config, action_value):
    """KL between the policy and the softmax of the critics (thesis 2.16, 2.17)."""

    def loss(actor):
        value, log_prob = action_value(state.critics, batch.observation, *actor.sample(batch.observation, key))
        return jnp.mean(jnp.exp(state.log_temperature) * log_prob - value), -log_prob.mean()

    (value, entropy), gradient = eqx.filter_value_and_grad(loss, has_aux=True)(state.actor)
    actor, optimiser = _apply(gradient, state.actor, state.actor_optimiser, config)
    state = eqx.tree_at(lambda s: (s.actor, s.actor_optimiser), state, (actor, optimiser))
    return state, {"actor_loss": value, "entropy": entropy}


def _update_temperature(state, entropy, batch, config):
    """Raise alpha while the entropy is below its target, lower it above."""
    gradient = entropy - config.target_entropy * batch.action.shape[-1]
    log_temperature, optimiser = _apply(gradient, state.log_temperature, state.temperature_optimiser, config)
    state = eqx.tree_at(lambda s: (s.log_temperature, s.temperature_optimiser), state, (log_temperature, optimiser))
    return state, {"temperature": jnp.exp(log_temperature)}


def _update_averages(state, config):
    target_critics = _average(state.target_critics, state.critics, config.target_rate)
    averaged_actor = _average(state.averaged_actor, state.actor, config.average_rate)
    return eqx.tree_at(lambda s: (s.target_critics, s.averaged_actor), state, (target_critics, averaged_actor))


def _average(old: Tree, new: Tree, rate: float) -> Tree:
    return jax.tree.map(lambda a, b: a + rate * (b - a), old, new)


def _optimiser(config: SACConfig) -> optax.GradientTransformation:
    schedule = optax.cosine_decay_schedule(
        config.learning_rate,
        config.decay_updates,
        alpha=config.final_learning_rate / config.learning_rate,
    )
    return optax.adam(schedule)


def _apply(gradient, parameters, optimiser, config):
    updates, optimiser = _optimiser(config).update(gradient, optimiser)
    return eqx.apply_updates(parameters, updates), optimiser
