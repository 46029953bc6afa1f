"""Meta-training on the toy: collect -> update inference -> update policies -> evaluate.

The encoder learns from nominal and from disturbed episodes, since it will meet gait ripple and lag on a
robot. The policy learns from the nominal ones alone: on a robot it runs in imagination only.
"""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.agents.parts import InferenceParts, load_inference
from rebody.bodies.toys import Toy, make_toy
from rebody.control import sac
from rebody.control.high_level import HighLevelPolicy
from rebody.control.sac import SACBatch, SACState
from rebody.errors import RebodyError
from rebody.inference.mixture.padded import Clusters, clusters_of, no_clusters
from rebody.inference.module import Evidence, InferenceModule, loss
from rebody.inference.normaliser import normalised
from rebody.inference.prior import Prior, SplitPrior, unit_gaussian
from rebody.inference.probe import unfitted
from rebody.jax_settings import own_jax_settings
from rebody.ranges import check_ranges
from rebody.training.arrival import arrival_bonus
from rebody.training.descent import descend
from rebody.training.inference.clusters import refit
from rebody.training.inference.config import MetaConfig
from rebody.training.inference.episodes import Episodes, collect, refresh_beliefs, roles
from rebody.training.inference.measure import measure
from rebody.training.inference.report import save_inference
from rebody.training.inference.told import ToldState, initial_told, update_told
from rebody.training.replay import store_group
from rebody.training.run import Metrics, Run, measured
from rebody.types import AnyArray, Transition, Tree

LENGTH = ("wander_iterations", "joint_iterations", "policy_iterations")
"""Settings that say how long the parts of a run are, in their order."""


class RunState(eqx.Module):
    """Everything that a resumed run needs."""

    module: InferenceModule
    optimiser: optax.OptState
    sac: SACState | None  # the high-level policy that goes by beliefs, where there is one
    told: ToldState  # the policy that is told the task: the toy's oracle
    clusters: Clusters
    replay: Episodes  # [group, episode, time]
    iteration: Int[Array, ""]


@own_jax_settings()
def train_inference(
    config: MetaConfig,
    out: Path,
    seed: int,
    *,
    title: str,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train an inference module with its high-level policy; returns the artifact's folder.

    RebodyError if `out` holds another run, or `init_from` has other sizes; Interrupted on Ctrl-C.
    """
    check_ranges(config)
    with Run(
        out, asdict(config) | {"seed": seed, "init_from": init_from}, length=LENGTH, resume=resume, finish=finish
    ) as run:
        toy, key = make_toy(config.toy), jax.random.key(seed)
        state = run.restore(initial_state(config, toy, key, init_from))
        state = run.loop(state, lambda state: iterate(state, toy, config, key), config.iterations, "inference")
        return save_inference(trained_parts(state, config), toy, config, run, title)


def iterate(state: RunState, toy: Toy, config: MetaConfig, key: PRNGKeyArray) -> tuple[RunState, Metrics]:
    """One turn of the loop."""
    iteration = int(state.iteration)
    keys = jax.random.split(jax.random.fold_in(key, iteration), 4)
    module, optimiser, clusters = state.module, state.optimiser, state.clusters
    policy, told = state.sac, state.told

    acting = roles(config.episodes, iteration < config.wander_iterations, config.acts_by)
    episodes = collect(module, (policy or told).actor, toy, config, acting, keys[0])
    metrics = {"return": episodes.reward[acting.decides].sum(-1).mean()}
    replay, stored = store_group(state.replay, episodes, state.iteration)
    if iteration < config.inference_iterations:
        if config.prior == "mixture" and iteration >= config.mixture.from_iteration:
            rng = np.random.default_rng(np.asarray(jax.random.key_data(keys[1])))
            clusters, cluster_metrics = refit(clusters, episodes, config, rng)
            metrics |= cluster_metrics
        module, optimiser, inference_metrics = update_inference(
            module, optimiser, replay, stored, latent_prior(clusters, config), config, keys[1]
        )
        told, learned = update_told(told, toy, config, keys[3])
        metrics |= inference_metrics | {f"told/{name}": value for name, value in learned.items()}
    if policy is not None and iteration >= config.wander_iterations:
        if iteration < config.inference_iterations:
            replay = refresh_beliefs(module.encoder, replay, config.episodes // 2)
        interpreted = eqx.tree_at(lambda e: e.belief, replay, module.decoder.interpret(replay.belief))
        policy, learned = update_policy(policy, interpreted, stored, config, keys[2])
        metrics |= learned
    state = RunState(module, optimiser, policy, told, clusters, replay, state.iteration + 1)
    return state, measured(
        metrics,
        iteration,
        config.evaluate_every,
        lambda: measure(trained_parts(state, config), toy, config, config.held_out),
    )


def latent_prior(clusters: Clusters, config: MetaConfig) -> Prior:
    """What the latent is drawn towards: where it is split, the mixture is for the kinds alone."""
    kinds = clusters.prior if config.prior == "mixture" else unit_gaussian
    inference = config.inference
    return SplitPrior(kinds, inference.kinds, inference.kind_weight) if inference.kinds else kinds


def initial_state(config: MetaConfig, toy: Toy, key: PRNGKeyArray, init_from: str | None = None) -> RunState:
    """Fresh networks, or those of an artifact, and an empty replay."""
    module_key, sac_key = jax.random.split(key)
    module = InferenceModule(config.inference, config.families, toy.actions, module_key)
    seen = config.policy_view.size(config.inference.latent)
    told = initial_told(config, toy, jax.random.fold_in(key, 2))
    policy = sac.initial_state(seen, toy.actions, config.sac, sac_key) if config.acts_by == "belief" else None
    clusters = no_clusters(config.mixture.maximum, config.inference.clustered)
    if init_from is not None:
        parts = load_inference(init_from).parts
        module = load_pretrained(parts.module, module, init_from)
        if policy is not None and parts.high_level is not None:
            policy = sac.take_over(policy, parts.high_level.actor, init_from)
        told = ToldState(load_pretrained(parts.told_policy.actor, told.actor, init_from), told.optimiser)
        if parts.mixture is not None and parts.mixture.mean.shape == clusters.prior.mean.shape:
            clusters = clusters_of(parts.mixture)
    actor = (policy or told).actor
    one_group = jax.eval_shape(lambda: collect(module, actor, toy, config, roles(config.episodes, True), key))
    return RunState(
        module=module,
        optimiser=optimiser_of(config).init(eqx.filter(module, eqx.is_array)),
        sac=policy,
        told=told,
        clusters=clusters,
        replay=jax.tree.map(lambda leaf: jnp.zeros((config.groups, *leaf.shape), leaf.dtype), one_group),
        iteration=jnp.zeros((), jnp.int32),
    )


def load_pretrained(trained: Tree, fresh: Tree, name: str) -> Tree:
    """The trained networks in place of fresh ones; RebodyError if its sizes differ."""
    if jax.tree.map(jnp.shape, trained) != jax.tree.map(jnp.shape, fresh):
        raise RebodyError(f"cannot start from '{name}': its networks have other sizes than these settings.")
    return trained


def trained_parts(state: RunState, config: MetaConfig) -> InferenceParts:
    """What is kept of a run, its probe not yet fitted."""
    by_belief = state.sac and HighLevelPolicy(state.sac.averaged_actor, config.policy_view)
    by_task = HighLevelPolicy(state.told.actor, config.told_view)
    mixture = jax.tree.map(jnp.asarray, state.clusters.prior) if config.prior == "mixture" else None
    return InferenceParts(state.module, by_belief, by_task, unfitted(config.families, config.inference.latent), mixture)


@eqx.filter_jit
def update_inference(
    module: InferenceModule,
    optimiser: optax.OptState,
    replay: Episodes,
    stored,
    prior: Prior,
    config: MetaConfig,
    key: PRNGKeyArray,
) -> tuple[InferenceModule, optax.OptState, dict[str, Float[Array, ""]]]:
    """Steps of encoder and decoder on windows of stored episodes."""

    def loss_of(module: InferenceModule, key: PRNGKeyArray):
        sample_key, loss_key = jax.random.split(key)
        evidence = sample_evidence(replay, stored, config, sample_key)
        return loss(module, evidence, prior, config.inference, loss_key)

    return descend(module, optimiser, optimiser_of(config), loss_of, jax.random.split(key, config.inference_updates))


@eqx.filter_jit
def update_policy(
    policy: SACState, replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """Steps of soft actor-critic on nominal episodes, with the beliefs that are held then."""

    def batch_of(_: None, key: PRNGKeyArray) -> SACBatch:
        return sample_transitions(replay, stored, config, key)

    return sac.update_many(policy, batch_of, None, jax.random.split(key, config.policy_updates), config.sac)


def sample_evidence(replay: Episodes, stored, config: MetaConfig, key: PRNGKeyArray) -> Evidence:
    """Windows of stored episodes, and transitions of the same episodes that their beliefs must explain.

    When a task changed is told to nobody, only how often tasks do.
    """
    keys = jax.random.split(key, 5)
    size, window = config.inference.batch_size, config.inference.window or config.decisions
    group = jax.random.randint(keys[0], (size, 1), 0, stored)
    episode = jax.random.randint(keys[1], (size, 1), 0, config.episodes)
    begin = jax.random.randint(keys[2], (size, 1), 0, config.decisions - window + 1)
    begin = jnp.where(jax.random.bernoulli(keys[3], config.begins_at_start, (size, 1)), 0, begin)
    seen = begin + jnp.arange(window)
    decoded = jax.random.randint(keys[4], (size, config.inference.decoded), 0, config.decisions)

    def at(time, along):
        return jax.tree.map(lambda leaf: leaf[group, episode, time], along)

    apart = jnp.abs(seen[:, :, None] - decoded[:, None])
    heard = at(seen, replay.reward)
    if config.inference.hears_any_law:
        whole = replay.reward[group[:, 0], episode[:, 0]]
        heard = jnp.take_along_axis(normalised(whole), seen, axis=-1)
    return Evidence(
        window=Transition(at(seen, replay.state), heard, at(seen + 1, replay.state)),
        base_task=config.families.base_task(at(seen, replay.task)),
        changed=1 - (1 - config.switch_share / config.decisions) ** apart,
        previous=at(decoded, replay.state),
        action=at(decoded, replay.action),
        reward=at(decoded, replay.reward),
        state=at(decoded + 1, replay.state),
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
        return config.policy_view(state, belief)

    return SACBatch(
        observation=observation(time),
        action=replay.action[group, episode, time],
        reward=_shaped(replay.reward[group, episode, time], config),
        next_observation=observation(time + 1),
        terminal=jnp.zeros(size),
    )


def _shaped(reward: Float[Array, " batch"], config: MetaConfig) -> Float[Array, " batch"]:
    return reward / config.inference.reward_scale + arrival_bonus(reward, config.arrival, config.arrival_width)


def optimiser_of(config: MetaConfig) -> optax.GradientTransformation:
    """What moves encoder and decoder: ever smaller steps.

    A run that is resumed with another length goes on along the new cosine from where its count of updates is.
    """
    updates = max(1, config.inference_iterations * config.inference_updates)
    schedule = optax.cosine_decay_schedule(config.inference.learning_rate, updates, alpha=0.05)
    return optax.chain(optax.clip_by_global_norm(1.0), optax.adam(schedule))
