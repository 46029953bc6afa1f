"""Collecting episodes on the toy, and what is kept of them."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, PRNGKeyArray

from rebody.agents.configs import understood
from rebody.bodies.disturbance import Randomisation, no_disturbance
from rebody.bodies.toys import Toy, ToyState
from rebody.control.places import TaskCode, places_of
from rebody.control.sac import Actor
from rebody.inference import Encoder, InferenceModule
from rebody.store import Artifact
from rebody.tasks import FamilySet
from rebody.tasks.family_set import sample_episodes
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.laws import first_pay
from rebody.types import AnyArray, Belief, GlobalState, Task, Transition, global_state


@dataclass(frozen=True)
class ToyWorld:
    """The tasks and disturbances that a module was trained on, out of its artifact."""

    families: FamilySet
    randomisation: Randomisation

    @classmethod
    def of(cls, module: Artifact) -> "ToyWorld":
        """From the artifact's settings; RebodyError where they do not tell."""
        parts = {"families": module.config["contract"], "randomisation": module.config["training"]}
        said = {name: part[name] for name, part in parts.items() if name in part}
        return understood(said, cls, module.name)

    def draw(self, key: PRNGKeyArray, episodes: int, decisions: int, switch_share: float, *, disturbed: bool):
        """Active tasks [time, episode], and how each episode's toy departs from the nominal one."""
        task_key, disturbance_key = jax.random.split(key)
        tasks = sample_episodes(self.families, task_key, episodes, decisions, switch_share)
        rough = self.randomisation.sample(disturbance_key, (episodes,))
        disturbance = rough if disturbed else no_disturbance((episodes,))
        return jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1), tasks), disturbance


FINDS_OUT = 0.4
"""Share of an episode within which a policy that is told tasks learns of its own."""


class Roles(eqx.Module):
    """How each episode's toy acts; where neither holds it samples its policy."""

    wanders: Bool[AnyArray, " episode"]  # holds random actions, to show the encoder what a policy would not
    decides: Bool[AnyArray, " episode"]  # takes the most likely action, as it will when it is used
    strays: Bool[AnyArray, " episode"]  # goes by a task that it is not paid for, where policies are told tasks


def roles(episodes: int, all_wander: bool, acts_by: str = "belief") -> Roles:
    """A quarter of the episodes decides, a quarter wanders; all wander at first. Where a policy is told tasks, another
    quarter decides, too, and every second episode strays.

    A toy that only ever sampled would keep moving by chance. Standing still beside its goal, where a window
    soon forgets on which side it lies, would then be new to encoder and policy when they are used.
    """
    quarter = jnp.arange(episodes) * 4 // episodes
    is_told = acts_by == "task"
    return Roles(
        wanders=(quarter == 3) | all_wander,
        decides=(quarter == 0) | ((quarter == 2) & is_told),
        strays=(jnp.arange(episodes) % 2 == 1) & is_told,
    )


class Episodes(eqx.Module):
    """Episodes as learning needs them; states and beliefs have one entry more than actions."""

    task: Task  # [*groups, episode, time], the active one
    state: GlobalState  # [*groups, episode, time + 1]
    belief: Belief  # [*groups, episode, time + 1]
    action: Float[AnyArray, "*groups episode time action"]
    reward: Float[AnyArray, "*groups episode time"]


@eqx.filter_jit
def collect(
    module: InferenceModule, actor: Actor, toy: Toy, config: MetaConfig, roles: Roles, key: PRNGKeyArray
) -> Episodes:
    """Let toys act on hidden tasks by what they believe. Rewards are those that are heard.

    The belief is always built from the running episode alone, never from stored ones.
    """
    task_key, start_key, observe_key, held_key, walk_key, known_key, law_key = jax.random.split(key, 7)
    shape = (config.episodes,)
    families = config.families
    task = sample_episodes(families, task_key, config.episodes, config.decisions, config.switch_share)
    body = _random_start(toy, config, start_key)
    seen = _observe(toy, body, config, observe_key)
    encoder, observed = module.encoder, _observer(module, config)
    belief = encoder.prior(shape)
    held = jax.random.uniform(held_key, (*shape, toy.actions), minval=-1.0)

    def decide(walk, inputs):
        task, known, key = inputs
        body, seen, carry, belief, held, pay = walk
        action_key, step_key, noise_key, wander_key = jax.random.split(key, 4)
        observation = observed(seen, belief, known)
        sampled, _ = actor.sample(observation, action_key)
        held = _wander(held, config.turn_probability, wander_key)
        action = jnp.where(roles.decides[:, None], actor(observation), sampled)
        action = jnp.where(roles.wanders[:, None], held, action)
        body = toy.step(body, action, step_key)
        pay, heard = pay.after(families, task, toy.observe(body), action, jax.random.fold_in(noise_key, 1))
        now_seen = _observe(toy, body, config, noise_key)
        carry, belief = encoder.step(carry, Transition(seen, heard, now_seen))
        return (body, now_seen, carry, belief, held, pay), (now_seen, belief, action, heard)

    laws = config.laws.draw(law_key, shape) if config.inference.hears_any_law else None
    pay = first_pay(laws, shape)
    walk = (body, seen, encoder.initial(shape), belief, held, pay)
    keys = jax.random.split(walk_key, config.decisions)
    known = _known(task, roles, config, known_key)
    active, known = jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1), (task, known))
    _, (states, beliefs, actions, rewards) = jax.lax.scan(decide, walk, (active, known, keys))
    along = (_prepend(seen, states), _prepend(belief, beliefs), actions, rewards)
    return Episodes(task, *jax.tree.map(lambda leaf: jnp.swapaxes(leaf, 0, 1), along))


def _observer(module: InferenceModule, config: MetaConfig) -> Callable[[GlobalState, Belief, Task], Any]:
    """What the acting policy sees of a state, a belief and the task that it knows of."""
    if config.acts_by == "belief":
        return lambda seen, belief, known: config.policy_view(seen, module.decoder.interpret(belief))
    code = TaskCode(places_of(config.families))
    return lambda seen, belief, known: config.told_view(seen, code(known))


def _known(task: Task, roles: Roles, config: MetaConfig, key: PRNGKeyArray) -> Task:
    """The tasks that a policy goes by which is told them: at first, and where it strays to the end, other ones.

    Who went for a target that it cannot know of yet would tell the encoder where it is.
    """
    other_key, when_key = jax.random.split(key)
    other = sample_episodes(config.families, other_key, config.episodes, config.decisions, 1.0)
    latest = jnp.where(roles.strays, config.decisions, FINDS_OUT * config.decisions)
    begins = jax.random.uniform(when_key, latest.shape, minval=jnp.where(roles.strays, 1.0, 0.05)) * latest
    knows = jnp.arange(config.decisions) >= begins[:, None]
    family = jnp.where(knows, task.family, other.family)
    return Task(family, jnp.where(knows[..., None], task.target, other.target))


@eqx.filter_jit
def refresh_beliefs(encoder: Encoder, episodes: Episodes, first: int) -> Episodes:
    """Groups of episodes with the beliefs that today's encoder holds along the first ones of each: those that a policy
    learns from."""
    state, reward = jax.tree.map(lambda leaf: jnp.moveaxis(leaf[:, :first], 2, 0), (episodes.state, episodes.reward))
    transitions = Transition(
        jax.tree.map(lambda leaf: leaf[:-1], state), reward, jax.tree.map(lambda leaf: leaf[1:], state)
    )
    shape = transitions.reward.shape[1:]
    _, beliefs = jax.lax.scan(
        lambda carry, transition: encoder.step(carry, transition), encoder.initial(shape), transitions
    )
    beliefs = _prepend(encoder.prior(shape), beliefs)
    beliefs = jax.tree.map(lambda old, new: old.at[:, :first].set(jnp.moveaxis(new, 0, 2)), episodes.belief, beliefs)
    return eqx.tree_at(lambda e: e.belief, episodes, beliefs)


def with_tasks(episodes: Episodes, code: TaskCode) -> Episodes:
    """The same episodes with the truth in place of what was believed; the last task lasts beyond the end."""
    time = episodes.task.family.ndim - 1
    active = jax.tree.map(lambda leaf: _with_last(leaf, time), episodes.task)
    return eqx.tree_at(lambda e: e.belief, episodes, code(active))


def _with_last(leaf: AnyArray, axis: int) -> jax.Array:
    """The last entry along an axis twice."""
    last = jax.lax.slice_in_dim(leaf, -1, None, axis=axis)
    return jnp.concatenate([leaf, last], axis=axis)


def _random_start(toy: Toy, config: MetaConfig, key: PRNGKeyArray) -> ToyState:
    """Anywhere, at any speed, so that the latent cannot take the start for the task."""
    where_key, disturbance_key, home_key = jax.random.split(key, 3)
    shape = (config.episodes,)
    nominal = jnp.arange(config.episodes) < config.episodes // 2
    starts = config.start, config.disturbed_start or config.start
    near, far = (jnp.asarray([x, vx, toy.max_pitch, x, vx, jnp.pi])[:, None] for x, vx in starts)
    away = ~jax.random.bernoulli(home_key, config.home_share, shape)
    drawn = jax.random.uniform(where_key, (6, *shape), minval=-1.0) * jnp.where(nominal, near, far) * away
    at = global_state(**dict(zip(("x", "vx", "pitch", "y", "vy", "yaw"), drawn, strict=True)))
    disturbance = jax.tree.map(
        lambda calm, rough: jnp.where(nominal, calm, rough),
        no_disturbance(shape),
        config.randomisation.sample(disturbance_key, shape),
    )
    return toy.begin(at, disturbance)


def _wander(
    held: Float[AnyArray, "episode action"], turn_probability: float, key: PRNGKeyArray
) -> Float[AnyArray, "episode action"]:
    turn_key, action_key = jax.random.split(key)
    turns = jax.random.bernoulli(turn_key, turn_probability, held.shape)
    return jnp.where(turns, jax.random.uniform(action_key, held.shape, minval=-1.0), held)


def _observe(toy: Toy, body: ToyState, config: MetaConfig, key: PRNGKeyArray) -> GlobalState:
    state = toy.observe(body)
    leaves, tree = jax.tree.flatten(state)
    noise = config.observation_noise**0.5 * jax.random.normal(key, (len(leaves), *state.x.shape))
    return tree.unflatten([leaf + disturbed for leaf, disturbed in zip(leaves, noise, strict=True)])


def _prepend(first, rest):
    return jax.tree.map(lambda a, b: jnp.concatenate([a[None], b]), first, rest)
