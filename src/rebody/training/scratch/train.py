"""Learning everything on a robot: what task is on, and how to do it (agent `scratch`).

The encoder and decoder of the toy's module learn from the robot's own episodes, the policy off-policy beside them on
beliefs that today's encoder holds along stored episodes, as PEARL does (Rakelly et al. 2019). Nothing is reused.
As on the toy, some are told their task, so that there is something to learn from before anything is believed.
"""

from dataclasses import asdict, replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float, Int, PRNGKeyArray

from rebody.agents.agent import FlatAgent
from rebody.agents.configs import ScratchSettings
from rebody.agents.controller import FlatController
from rebody.agents.parts import ScratchParts, load_scratch
from rebody.agents.rollout import Episodes as Rollouts
from rebody.bodies import RobotBatch, RobotSpec
from rebody.control import sac
from rebody.control.command import commands_within
from rebody.control.flat import FlatPolicy
from rebody.control.places import TaskCode
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.inference.module import InferenceModule
from rebody.inference.prior import SplitPrior, unit_gaussian
from rebody.inference.probe import unfitted
from rebody.jax_settings import own_jax_settings
from rebody.tasks import SHIPPED
from rebody.tasks.family_set import sample_episodes
from rebody.training.card import save
from rebody.training.held_out import act, figures_of, rows_of
from rebody.training.inference.episodes import Episodes, refresh_beliefs, with_tasks
from rebody.training.inference.measure import contract_of, probe_of
from rebody.training.inference.train import load_pretrained, optimiser_of, update_inference
from rebody.training.motion import decision, privileged_reward, put_on_feet
from rebody.training.off_policy import ready_robot
from rebody.training.replay import store_group
from rebody.training.run import Metrics, Run, measured
from rebody.training.scratch.config import ScratchConfig
from rebody.training.task_inference import TaskInference, begin_inference, infer
from rebody.types import POSE_FIELDS, AnyArray, Belief, GlobalState, Task, global_state


class ControlSteps(eqx.Module):
    """Control steps of robots; a replay has [group, step, robot]."""

    joints: Float[AnyArray, "*steps robot joint"]
    pose: Float[AnyArray, "*steps robot 6"]
    action: Float[AnyArray, "*steps robot action"]
    reward: Float[AnyArray, "*steps robot"]
    next_joints: Float[AnyArray, "*steps robot joint"]
    next_pose: Float[AnyArray, "*steps robot 6"]


class Replay(eqx.Module):
    """A ring of groups: an episode of every robot, its decisions and its control steps."""

    episodes: Episodes
    steps: ControlSteps


class RunState(eqx.Module):
    """Everything that a resumed run needs; robots begin anew in every iteration."""

    module: InferenceModule
    optimiser: optax.OptState
    sac: SACState
    replay: Replay
    iteration: Int[Array, ""]


@own_jax_settings()
def train_scratch(
    robot: str,
    config: ScratchConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train module and policy; returns the artifact's folder.

    RebodyError if the robot is not ready, `out` holds another run, or `init_from` has other sizes; Interrupted on
    Ctrl-C.
    """
    spec = ready_robot(robot, config)
    with Run(
        out, asdict(config) | {"robot": robot, "seed": seed, "init_from": init_from}, resume=resume, finish=finish
    ) as run:
        batch = RobotBatch(spec, config.robots)
        state = run.restore(initial_state(config, batch, jax.random.key(seed), init_from))
        state = run.loop(state, lambda state: iterate(state, batch, config, seed), config.iterations, "scratch")
        return save_scratch(trained_parts(state, config), spec, config, run)


def iterate(state: RunState, batch: RobotBatch, config: ScratchConfig, seed: int) -> tuple[RunState, Metrics]:
    """An episode of every robot, then updates of the module and of the policy, now and then an evaluation."""
    iteration, meta = int(state.iteration), config.meta(batch.spec.reach)
    rng = np.random.default_rng((seed, 2, iteration))
    keys = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration), 3)

    fresh = collect(state, batch, config, rng, keys[0])
    replay, stored = store_group(state.replay, fresh, state.iteration)
    prior = SplitPrior(unit_gaussian, config.inference.kinds, config.inference.kind_weight)
    module, optimiser, metrics = update_inference(
        state.module, state.optimiser, replay.episodes, stored, prior, meta, keys[1]
    )
    if (iteration + 1) % config.refresh_every == 0:
        replay = replace(replay, episodes=refresh_beliefs(module.encoder, replay.episodes, config.robots))
    policy, learned = update_policy(state.sac, module, replay, stored, config, keys[2])
    state = RunState(module, optimiser, policy, replay, state.iteration + 1)
    metrics |= learned | {"task_reward": fresh.episodes.reward.mean()}
    return state, measured(
        metrics, iteration, config.evaluate_every, lambda: measure(trained_parts(state, config), config, batch.spec)
    )


def collect(
    state: RunState, batch: RobotBatch, config: ScratchConfig, rng: np.random.Generator, key: PRNGKeyArray
) -> Replay:
    """One group: every robot acts on a hidden task by what it believes, or by what it is told."""
    task_key, action_key = jax.random.split(key)
    meta, encoder = config.meta(batch.spec.reach), state.module.encoder
    tasks = sample_episodes(meta.families, task_key, config.robots, config.decisions, config.switch_share)
    tasks = jax.tree.map(np.asarray, tasks)
    batch.reset(rng)
    batch.place(rng.uniform(-config.start, config.start, batch.size))
    here, first = batch.observe(), jax.tree.map(lambda leaf: leaf[:, 0], tasks)
    known = begin_inference(encoder, here, first)
    states, beliefs, actions, rewards, steps = [here], [known.belief], [], [], []
    for i in range(config.decisions):
        known = replace(known, task=jax.tree.map(lambda leaf: leaf[:, i], tasks))  # noqa: B023 (used at once)
        now, held = act_for_a_decision(state, known, batch, config, rng, jax.random.fold_in(action_key, i))
        known, earned = infer(encoder, known, now, meta.families)
        steps += held
        states.append(known.state)
        beliefs.append(known.belief)
        actions.append(np.mean([step.action for step in held], axis=0))
        rewards.append(earned)
    along = [jax.tree.map(lambda *rows: np.stack(rows, axis=1), *rows) for rows in (states, beliefs, actions, rewards)]
    return Replay(Episodes(tasks, *along), jax.tree.map(lambda *rows: np.stack(rows), *steps))


def act_for_a_decision(
    state: RunState,
    known: TaskInference,
    batch: RobotBatch,
    config: ScratchConfig,
    rng: np.random.Generator,
    key: PRNGKeyArray,
) -> tuple[GlobalState, list[ControlSteps]]:
    """Control steps by the same belief; the state after them, and the steps."""
    interpreted, steps = interpret(state.module, known, config), []
    families, commands = config.families, commands_within(batch.spec.reach, config.families.beside(SHIPPED))

    def control_step(i: int) -> None:
        joints, before = batch.joint_state(), batch.pose()
        pose = before.astype(np.float32)
        action = np.asarray(_explore(state.sac.actor, config, joints, pose, interpreted, jax.random.fold_in(key, i)))
        batch.step(action)
        reward = privileged_reward(batch, before, known.task, action, families, commands, config.reward)
        steps.append(ControlSteps(joints, pose, action, reward, batch.joint_state(), batch.pose().astype(np.float32)))
        put_on_feet(batch, rng)

    return decision(batch, control_step)[0], steps


@eqx.filter_jit
def update_policy(
    policy: SACState, module: InferenceModule, replay: Replay, stored, config: ScratchConfig, key: PRNGKeyArray
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """Steps of soft actor-critic on stored control steps, with today's beliefs."""
    believed = module.decoder.interpret(replay.episodes.belief)
    told = with_tasks(replay.episodes, TaskCode(config.places)).belief

    def batch_of(_: None, key: PRNGKeyArray) -> SACBatch:
        return sample_steps(replay, believed, told, stored, config, key)

    return sac.update_many(policy, batch_of, None, jax.random.split(key, config.policy_updates), config.sac)


def sample_steps(
    replay: Replay, believed: Belief, told: Belief, stored, config: ScratchConfig, key: PRNGKeyArray
) -> SACBatch:
    """Control steps drawn evenly from the groups, each with the beliefs held before and after, or with the truth."""
    episodes, steps, size = replay.episodes, replay.steps, (config.sac.batch_size,)
    _, length, robots = steps.reward.shape
    keys = jax.random.split(key, 4)
    group = jax.random.randint(keys[0], size, 0, stored)
    step = jax.random.randint(keys[1], size, 0, length)
    robot = jax.random.randint(keys[2], size, 0, robots)
    is_told = jax.random.bernoulli(keys[3], config.told_share, size)
    chosen = jax.tree.map(lambda leaf: leaf[group, step, robot], steps)
    per_decision = length // episodes.reward.shape[-1]

    def observation(joints, pose, step):
        at = group, robot, step // per_decision
        held = jax.tree.map(lambda yes, no: jnp.where(is_told[:, None], yes[at], no[at]), told, believed)
        return config.view(joints, pose, held)

    return SACBatch(
        observation=observation(chosen.joints, chosen.pose, step),
        action=chosen.action,
        reward=chosen.reward,
        next_observation=observation(chosen.next_joints, chosen.next_pose, step + 1),
        terminal=jnp.zeros(size),  # what has fallen goes on
    )


def initial_state(
    config: ScratchConfig, batch: RobotBatch, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Fresh networks, or those of an artifact, and an empty replay."""
    module_key, sac_key = jax.random.split(key)
    actions, joints = batch.spec.model.nu, batch.joint_state().shape[-1]
    module = InferenceModule(config.inference, config.families, actions, module_key)
    seen = config.view.size(joints, config.inference.latent)
    policy = sac.initial_state(seen, actions, config.sac, sac_key)
    if init_from is not None:
        parts = load_scratch(init_from).parts
        module = load_pretrained(parts.module, module, init_from)
        policy = sac.take_over(policy, parts.policy.actor, init_from)
    return RunState(
        module=module,
        optimiser=optimiser_of(config.meta(batch.spec.reach)).init(eqx.filter(module, eqx.is_array)),
        sac=policy,
        replay=_no_replay(config, batch),
        iteration=jnp.zeros((), jnp.int32),
    )


def _no_replay(config: ScratchConfig, batch: RobotBatch) -> Replay:
    groups, robots, decisions = config.groups, config.robots, config.decisions
    steps, actions = decisions * batch.spec.steps_per_decision, batch.spec.model.nu
    joints = jnp.zeros((groups, steps, robots, batch.joint_state().shape[-1]))
    per_step, per_decision = jnp.zeros((groups, steps, robots)), jnp.zeros((groups, robots, decisions))
    between, pose = jnp.zeros((groups, robots, decisions + 1)), jnp.zeros((*per_step.shape, len(POSE_FIELDS)))
    latent = jnp.zeros((*between.shape, config.inference.latent))
    acted = jnp.zeros((groups, robots, decisions, actions))
    return Replay(
        Episodes(
            Task(jnp.zeros(per_decision.shape, jnp.int32), jnp.zeros((*per_decision.shape, config.families.size))),
            global_state(x=between),
            Belief(latent, latent),
            acted,
            per_decision,
        ),
        ControlSteps(joints, pose, jnp.zeros((groups, steps, robots, actions)), per_step, joints, pose),
    )


def trained_parts(state: RunState, config: ScratchConfig) -> ScratchParts:
    """What is kept of a run, its probe not yet fitted."""
    policy = FlatPolicy(state.sac.averaged_actor, config.view)
    return ScratchParts(state.module, policy, unfitted(config.families, config.inference.latent))


@eqx.filter_jit
def interpret(module: InferenceModule, known: TaskInference, config: ScratchConfig) -> Belief:
    """What each robot goes by: the first ones are told."""
    robots = jnp.arange(config.robots)[:, None]
    told, believed = TaskCode(config.places)(known.task), module.decoder.interpret(known.belief)
    return jax.tree.map(lambda yes, no: jnp.where(robots < config.told_share * config.robots, yes, no), told, believed)


@eqx.filter_jit
def _explore(actor: Actor, config: ScratchConfig, joints, pose, interpreted: Belief, key: PRNGKeyArray):
    observation = config.view(joints, pose, interpreted)
    decides = jnp.arange(len(pose))[:, None] % config.decides_every == 0
    return jnp.where(decides, actor(observation), actor.sample(observation, key)[0])


def measure(parts: ScratchParts, config: ScratchConfig, spec: RobotSpec) -> dict[str, float]:
    """Final error on held-out tasks of each family, return, share that fell."""
    return figures_of(config.families, *act_on(parts, config, spec, seed=0))


def act_on(parts: ScratchParts, config: ScratchConfig, spec: RobotSpec, *, seed: int) -> tuple[Task, Rollouts]:
    """Robots on held-out tasks."""
    agent = FlatAgent(families=config.families, inferrer=parts.module.encoder, reader=parts.probe, stride=1)
    controller, meta = FlatController(parts.policy, parts.module.decoder), config.meta(spec.reach)
    return act(agent, controller, spec, meta.families, config.held_out, config.held_out_s, seed)


def save_scratch(parts: ScratchParts, spec: RobotSpec, config: ScratchConfig, run: Run) -> Path:
    """Measure, fit the probe on other tasks, write artifact and card."""
    figures = measure(parts, config, spec)
    parts = eqx.tree_at(lambda p: p.probe, parts, probe_of(config.families, *act_on(parts, config, spec, seed=1)))
    actor = parts.policy.actor
    settings = ScratchSettings(
        robot=spec.name,
        contract=contract_of(config.meta(spec.reach)),
        inference=config.inference,
        observations=actor.observations,
        actions=actor.actions,
        hidden=config.sac.hidden,
        projections=config.sac.projections,
        training=run.training(config),
    )
    rows = rows_of(config.families, figures, config.held_out, config.held_out_s)
    decisions = run.iterations * config.robots * config.decisions
    what = (
        f"Inference module and joint policy of '{spec.name}', learned together on the robot: nothing is reused. "
        f"Trained on {decisions * spec.steps_per_decision:,} control steps with "
        f"{run.iterations * config.policy_updates:,} updates of the policy and "
        f"{run.iterations * config.inference_updates:,} of the module."
    )
    return save("scratch", settings, parts, run, f"From scratch: {spec.name}", what, rows)
