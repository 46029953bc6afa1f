"""Meta-training on the toy: collect -> update inference -> update policy -> evaluate.

The encoder learns from nominal and from disturbed episodes, since it will meet gait ripple and lag on a
robot. The policy learns from the nominal ones alone: on a robot it runs in imagination only.
"""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.agents.parts import load_inference
from rebody.bodies.toys import MassDamper
from rebody.control import sac
from rebody.control.high_level import policy_observation
from rebody.control.sac import SACBatch, SACState
from rebody.errors import RebodyError
from rebody.inference.module import Evidence, InferenceModule, loss
from rebody.inference.prior import unit_gaussian
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.episodes import Episodes, collect, refresh_beliefs, roles
from rebody.training.inference.report import measure, save_inference
from rebody.training.run import Metrics, Run
from rebody.types import Transition

EVALUATE_EVERY = 10
BEGINS_AT_START = 0.3
"""Share of windows that begin with their episode, when nothing is known: the first decisions count."""


class RunState(eqx.Module):
    """Everything that a resumed run needs."""

    module: InferenceModule
    optimiser: optax.OptState
    sac: SACState
    replay: Episodes  # [group, episode, time]
    iteration: Int[Array, ""]


def train_inference(
    config: MetaConfig,
    out: Path,
    seed: int,
    *,
    title: str,
    resume: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train an inference module with its high-level policy; returns the artifact's folder.

    RebodyError if `out` holds another run, or `init_from` has other sizes; Interrupted on Ctrl-C.
    """
    run = Run(out, asdict(config) | {"seed": seed, "init_from": init_from}, resume=resume)
    toy, key = MassDamper(), jax.random.key(seed)
    state = run.restore(initial_state(config, toy, key, init_from))
    state = run.loop(state, lambda state: iterate(state, toy, config, key), config.iterations, "inference")
    return save_inference(state.module, state.sac.averaged_actor, toy, config, run, seed, title)


def iterate(state: RunState, toy: MassDamper, config: MetaConfig, key: PRNGKeyArray) -> tuple[RunState, Metrics]:
    """One turn of the loop."""
    iteration = int(state.iteration)
    keys = jax.random.split(jax.random.fold_in(key, iteration), 3)
    module, optimiser, policy = state.module, state.optimiser, state.sac
    metrics = {}

    acting = roles(config.episodes, all_wander=iteration < config.wander_iterations)
    episodes = collect(module.encoder, policy.actor, toy, config, acting, keys[0])
    replay, stored = store(state.replay, episodes, iteration)
    if iteration < config.inference_iterations:
        module, optimiser, metrics = update_inference(module, optimiser, replay, stored, config, keys[1])
        replay = refresh_beliefs(module.encoder, replay)
    if iteration >= config.wander_iterations:
        policy, policy_metrics = update_policy(policy, replay, stored, config, keys[2])
        metrics |= policy_metrics
    if (iteration + 1) % EVALUATE_EVERY == 0:
        figures = measure(module, policy.averaged_actor, toy, config)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}

    state = RunState(module, optimiser, policy, replay, state.iteration + 1)
    return state, {name: float(value) for name, value in metrics.items()}


def initial_state(config: MetaConfig, toy: MassDamper, key: PRNGKeyArray, init_from: str | None = None) -> RunState:
    """Fresh networks, or those of an artifact, and an empty replay."""
    module_key, sac_key = jax.random.split(key)
    module = InferenceModule(config.inference, 1, module_key)
    policy = sac.initial_state(len(config.policy_fields) + 2 * config.inference.latent, 1, config.sac, sac_key)
    if init_from is not None:
        module, policy = _take_over(init_from, module, policy)
    one_group = jax.eval_shape(
        lambda: collect(module.encoder, policy.actor, toy, config, roles(config.episodes, True), key)
    )
    return RunState(
        module=module,
        optimiser=_optimiser(config).init(eqx.filter(module, eqx.is_array)),
        sac=policy,
        replay=jax.tree.map(lambda leaf: jnp.zeros((config.groups, *leaf.shape), leaf.dtype), one_group),
        iteration=jnp.zeros((), jnp.int32),
    )


def _take_over(reference: str, module: InferenceModule, policy: SACState) -> tuple[InferenceModule, SACState]:
    parts = load_inference(reference).parts
    actor = parts.high_level.actor
    if jax.tree.map(jnp.shape, (parts.module, actor)) != jax.tree.map(jnp.shape, (module, policy.actor)):
        raise RebodyError(f"cannot start from '{reference}': its networks have other sizes than these settings.")
    return parts.module, eqx.tree_at(lambda p: (p.actor, p.averaged_actor), policy, (actor, actor))


@eqx.filter_jit
def store(replay: Episodes, episodes: Episodes, iteration: Int[Array, ""] | int):
    """The ring with a group more in place of its oldest, and how many groups it holds."""
    groups = replay.reward.shape[0]
    replay = jax.tree.map(lambda ring, new: ring.at[iteration % groups].set(new), replay, episodes)
    return replay, jnp.minimum(iteration + 1, groups)


@eqx.filter_jit
def update_inference(
    module: InferenceModule, optimiser: optax.OptState, replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray
) -> tuple[InferenceModule, optax.OptState, dict[str, Float[Array, ""]]]:
    """Steps of encoder and decoder on windows of stored episodes."""
    arrays, static = eqx.partition(module, eqx.is_array)

    def step(carry, key):
        arrays, optimiser = carry
        sample_key, loss_key = jax.random.split(key)
        evidence = sample_evidence(replay, stored, config, sample_key)
        gradient, metrics = jax.grad(
            lambda a: loss(eqx.combine(a, static), evidence, unit_gaussian, config.inference, loss_key),
            has_aux=True,
        )(arrays)
        updates, optimiser = _optimiser(config).update(gradient, optimiser)
        return (eqx.apply_updates(arrays, updates), optimiser), metrics

    keys = jax.random.split(key, config.inference_updates)
    (arrays, optimiser), metrics = jax.lax.scan(step, (arrays, optimiser), keys)
    return eqx.combine(arrays, static), optimiser, jax.tree.map(jnp.mean, metrics)


@eqx.filter_jit
def update_policy(
    policy: SACState, replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray
) -> tuple[SACState, dict[str, Float[Array, ""]]]:
    """Steps of soft actor-critic on nominal episodes, with the beliefs held then."""
    arrays, static = eqx.partition(policy, eqx.is_array)

    def step(arrays, key):
        sample_key, update_key = jax.random.split(key)
        batch = sample_transitions(replay, stored, config, sample_key)
        updated, metrics = sac.update(eqx.combine(arrays, static), batch, update_key, config.sac)
        return eqx.filter(updated, eqx.is_array), metrics

    arrays, metrics = jax.lax.scan(step, arrays, jax.random.split(key, config.policy_updates))
    return eqx.combine(arrays, static), jax.tree.map(jnp.mean, metrics)


def sample_evidence(replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray) -> Evidence:
    """Windows of stored episodes, and transitions of the same episodes that their beliefs must explain."""
    keys = jax.random.split(key, 5)
    size, window = config.inference.batch_size, config.inference.window
    group = jax.random.randint(keys[0], (size, 1), 0, stored)
    episode = jax.random.randint(keys[1], (size, 1), 0, config.episodes)
    begin = jax.random.randint(keys[2], (size, 1), 0, config.decisions - window + 1)
    begin = jnp.where(jax.random.bernoulli(keys[3], BEGINS_AT_START, (size, 1)), 0, begin)
    seen = begin + jnp.arange(window)
    decoded = jax.random.randint(keys[4], (size, config.inference.decoded), 0, config.decisions)

    def state(time):
        return jax.tree.map(lambda leaf: leaf[group, episode, time], replay.state)

    return Evidence(
        window=Transition(state(seen), replay.reward[group, episode, seen], state(seen + 1)),
        previous=state(decoded),
        action=replay.action[group, episode, decoded],
        reward=replay.reward[group, episode, decoded],
        state=state(decoded + 1),
    )


def sample_transitions(replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray) -> SACBatch:
    """Decisions of nominal episodes, with the beliefs before and after."""
    group_key, episode_key, time_key = jax.random.split(key, 3)
    size = (config.sac.batch_size,)
    group = jax.random.randint(group_key, size, 0, stored)
    episode = jax.random.randint(episode_key, size, 0, config.episodes // 2)
    time = jax.random.randint(time_key, size, 0, config.decisions)

    def observation(time):
        state, belief = jax.tree.map(lambda leaf: leaf[group, episode, time], (replay.state, replay.belief))
        return policy_observation(state, belief, config.policy_fields, config.policy_scales)

    return SACBatch(
        observation=observation(time),
        action=replay.action[group, episode, time],
        reward=_shaped(replay.reward[group, episode, time], config),
        next_observation=observation(time + 1),
        terminal=jnp.zeros(size),
    )


def _shaped(reward: Float[Array, " batch"], config: MetaConfig) -> Float[Array, " batch"]:
    return reward / config.inference.reward_scale + config.arrival * 0.1 / (0.1 - reward)


def _optimiser(config: MetaConfig) -> optax.GradientTransformation:
    updates = max(1, config.inference_iterations * config.inference_updates)
    schedule = optax.cosine_decay_schedule(config.inference.learning_rate, updates, alpha=0.05)
    return optax.chain(optax.clip_by_global_norm(1.0), optax.adam(schedule))
