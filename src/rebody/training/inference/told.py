"""The policy that is told its task, learned by gradients through the toy (analytic policy gradients).

A nominal toy is arithmetic and its rewards are known, so what a short course earns is differentiable in the policy. No
critic looks beyond its end (as in SHAC, Xu et al. 2022): rewards are dense, and a toy brakes sooner than that.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Float, PRNGKeyArray

from rebody.bodies.toys import Toy
from rebody.control.places import TaskCode, numbers_of, places_of
from rebody.control.sac import Actor
from rebody.tasks.family_set import sample
from rebody.training.arrival import arrival_bonus
from rebody.training.descent import Metrics, descend
from rebody.training.inference.config import MetaConfig
from rebody.types import AnyArray, GlobalState, Task, global_state


class ToldState(eqx.Module):
    """Everything that an update reads and writes."""

    actor: Actor
    optimiser: optax.OptState


def initial_told(config: MetaConfig, toy: Toy, key: PRNGKeyArray) -> ToldState:
    """A fresh policy."""
    places = places_of(config.families)
    actor = Actor(config.told_view.size(len(places) + numbers_of(places)), toy.actions, config.sac, key)
    return ToldState(actor, _optimiser(config).init(eqx.filter(actor, eqx.is_array)))


@eqx.filter_jit
def update_told(state: ToldState, toy: Toy, config: MetaConfig, key: PRNGKeyArray) -> tuple[ToldState, Metrics]:
    """Steps up what courses earn, on tasks drawn anew each time."""

    def loss(actor: Actor, key: PRNGKeyArray):
        earned = course(actor, toy, config, key)
        bonus = arrival_bonus(earned, config.arrival, config.arrival_width)
        metrics = {"return": earned.sum(axis=0).mean()}
        return -jnp.mean(earned / config.inference.reward_scale + bonus), metrics

    keys = jax.random.split(key, config.told.updates)
    actor, optimiser, metrics = descend(state.actor, state.optimiser, _optimiser(config), loss, keys)
    return ToldState(actor, optimiser), metrics


def course(actor: Actor, toy: Toy, config: MetaConfig, key: PRNGKeyArray) -> Float[AnyArray, "decision course"]:
    """Rewards of nominal toys that go by the policy."""
    task_key, start_key = jax.random.split(key)
    task = sample(config.families, task_key, (config.told.courses,))
    told = TaskCode(places_of(config.families))(task)

    def step(body, _):
        action = actor(config.told_view(toy.observe(body), told))
        body = toy.step(body, action, key)  # which has no noise
        return body, config.families.reward(task, toy.observe(body))

    return jax.lax.scan(step, toy.begin(starts(task, toy, config, start_key)), None, length=config.told.decisions)[1]


def starts(task: Task, toy: Toy, config: MetaConfig, key: PRNGKeyArray) -> GlobalState:
    """Anywhere, at any speed; a share with what its family asks for near its target."""
    where_key, near_key = jax.random.split(key)
    shape, (far, fast) = task.family.shape, config.start
    ends = {"x": far, "y": far, "vx": fast, "vy": fast, "pitch": toy.max_pitch, "yaw": jnp.pi}
    shares = jax.random.uniform(where_key, (len(ends), *shape), minval=-1.0)
    begun = {field: end * share for (field, end), share in zip(ends.items(), shares, strict=True)}
    is_near = jax.random.bernoulli(near_key, config.told.near, shape)
    for i, family in enumerate(config.families):
        for axis, field in enumerate(family.quantity.components):
            off = family.floor * jax.random.uniform(jax.random.fold_in(near_key, i + 7 * axis), shape, minval=-1.0)
            anywhere = begun.get(field, jnp.zeros(shape))
            begun[field] = jnp.where(is_near & (task.family == i), task.target[..., axis] + off, anywhere)
    return global_state(**begun)


def _optimiser(config: MetaConfig) -> optax.GradientTransformation:
    told = config.told
    updates = max(1, config.inference_iterations * told.updates)
    schedule = optax.cosine_decay_schedule(told.learning_rate, updates, alpha=0.02)
    return optax.chain(optax.clip_by_global_norm(1.0), optax.adam(schedule))
