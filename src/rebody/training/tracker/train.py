"""Training a tracker with soft actor-critic (thesis 5.5, 6.3.3).

Many robots follow changing orders; half of every batch is learned from under commands that were never
given, since the reward of any command follows from how the robot moved.
"""

from dataclasses import asdict
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int, PRNGKeyArray

from rebody.agents.parts import load_tracker
from rebody.bodies import RobotBatch, load_robot
from rebody.control import sac
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.control.tracker import Command, Tracker, tracker_observation, tracker_reward
from rebody.tasks import GOAL
from rebody.training.ring import draw, write
from rebody.training.run import Metrics, Run
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.orders import Orders, commands, follow_guides, no_orders, renew
from rebody.training.tracker.report import measure, save_tracker
from rebody.types import AnyArray

EVALUATE_EVERY = 50


class Replay(eqx.Module):
    """Transitions of control steps: a ring in host memory, written in place, or batches drawn from it."""

    joints: Float[AnyArray, "*size joint"]
    action: Float[AnyArray, "*size action"]
    next_joints: Float[AnyArray, "*size joint"]
    displacement: Float[AnyArray, "*size"]  # m, over the control step
    pitch: Float[AnyArray, "*size"]  # rad, after it
    slot: Int[AnyArray, "*size"]
    value: Float[AnyArray, "*size"]  # command relative to the robot, before the step


class RunState(eqx.Module):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: Replay
    orders: Orders
    physics: Float[np.ndarray, "robot state"]
    previous_qpos: Float[np.ndarray, "robot nq"]  # at the last decision
    lying_s: Float[np.ndarray, " robot"]
    iteration: Int[np.ndarray, ""]


def train_tracker(
    robot: str,
    config: TrackerConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a tracker; returns the artifact's folder.

    RebodyError if `out` holds another run, or `init_from` has other sizes; Interrupted on Ctrl-C.
    """
    spec = load_robot(robot)
    run = Run(out, asdict(config) | {"robot": robot, "seed": seed, "init_from": init_from}, resume=resume)
    batch = RobotBatch(spec, config.robots)
    batch.reset(np.random.default_rng((seed, 1)))
    state = run.restore(initial_state(config, batch, jax.random.key(seed), init_from))
    batch.state, batch.lying_s[:] = state.physics, state.lying_s
    state = run.loop(state, lambda state: iterate(state, batch, config, seed), config.iterations, "tracker")
    return save_tracker(_tracker(state, config), spec, config, run, seed)


def iterate(state: RunState, batch: RobotBatch, config: TrackerConfig, seed: int) -> tuple[RunState, Metrics]:
    """Move the robots, learn from the replay, now and then evaluate."""
    iteration = int(state.iteration)
    rng = np.random.default_rng((seed, 2, iteration))
    collect_key, learn_key = jax.random.split(jax.random.fold_in(jax.random.key(seed), iteration))
    collect(state, batch, config, rng, collect_key)
    written = (iteration + 1) * config.steps * config.robots
    transitions = draw(state.replay, written, (config.updates, config.sac.batch_size), rng)
    policy, metrics = learn(state.sac, transitions, learn_key, config, batch.spec.control_dt)
    state = eqx.tree_at(
        lambda s: (s.sac, s.physics, s.lying_s, s.iteration),
        state,
        (policy, batch.state, batch.lying_s.copy(), state.iteration + 1),
    )
    if (iteration + 1) % EVALUATE_EVERY == 0:
        figures = measure(_tracker(state, config), batch.spec)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}
    return state, {name: float(value) for name, value in metrics.items()}


def collect(
    state: RunState, batch: RobotBatch, config: TrackerConfig, rng: np.random.Generator, key: PRNGKeyArray
) -> None:
    """Move every robot by `config.steps` control steps under its orders; write the replay in place."""
    spec, orders = batch.spec, state.orders
    first_row = int(state.iteration) * config.steps * config.robots
    for step in range(config.steps):
        order_key, action_key = jax.random.split(jax.random.fold_in(key, step))
        renew(orders, batch, config, rng, order_key)
        if step % spec.steps_per_decision == 0:
            follow_guides(orders, spec.observe(batch.qpos, state.previous_qpos), config)
            state.previous_qpos[:] = batch.qpos
        joints, x, command = spec.joint_state(batch.qpos, batch.qvel), batch.x, commands(orders, batch.x)
        action = np.asarray(_explore(state.sac.actor, joints, command, action_key, config))
        batch.step(action)
        seen = Replay(
            joints=joints,
            action=action,
            next_joints=spec.joint_state(batch.qpos, batch.qvel),
            displacement=(batch.x - x).astype(np.float32),
            pitch=spec.pitch(batch.qpos).astype(np.float32),
            slot=command.slot,
            value=command.value,
        )
        write(state.replay, first_row + step * config.robots, seen)
        reset_the_fallen(state, batch, rng)


def reset_the_fallen(state: RunState, batch: RobotBatch, rng: np.random.Generator) -> None:
    """A robot that has fallen starts anew; what it did stays in the replay."""
    fallen = batch.fallen
    batch.reset(rng, fallen)
    state.orders.steps_left[fallen] = 0
    state.previous_qpos[fallen] = batch.qpos[fallen]


@eqx.filter_jit
def learn(
    policy: SACState, transitions: Replay, key: PRNGKeyArray, config: TrackerConfig, control_dt: float
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """One update of soft actor-critic per batch."""

    def batch_of(transitions: Replay, key: PRNGKeyArray) -> SACBatch:
        return relabel(transitions, key, config, control_dt)

    return sac.update_many(policy, batch_of, transitions, jax.random.split(key, config.updates), config.sac)


def relabel(transitions: Replay, key: PRNGKeyArray, config: TrackerConfig, control_dt: float) -> SACBatch:
    """Transitions with their own command or a new one, and the reward that it would have brought.

    A command is taken to last: afterwards the same goal in the world is nearer, a speed is the same.
    """
    size = transitions.slot.shape[0]
    fresh = config.commands.sample(key, (size,))
    renewed = jnp.arange(size) < config.relabelled * size
    command = Command(
        jnp.where(renewed, fresh.slot, transitions.slot), jnp.where(renewed, fresh.value, transitions.value)
    )
    approached = jnp.where(command.slot == GOAL, transitions.displacement, 0.0)
    later = Command(command.slot, command.value - approached)
    limits = (config.commands.max_distance, config.commands.max_speed)
    return SACBatch(
        observation=tracker_observation(transitions.joints, command, *limits),
        action=transitions.action,
        reward=tracker_reward(
            command,
            transitions.displacement,
            control_dt,
            transitions.pitch,
            transitions.action,
            config.reward,
        ),
        next_observation=tracker_observation(transitions.next_joints, later, *limits),
        terminal=jnp.zeros(size),
    )


def initial_state(
    config: TrackerConfig, batch: RobotBatch, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Robots without orders, an empty replay, a fresh policy or that of an artifact."""
    spec, rows = batch.spec, config.replay
    joints = spec.joint_state(batch.qpos, batch.qvel)
    policy = sac.initial_state(observation_size(joints), spec.model.nu, config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, load_tracker(init_from).tracker.actor, init_from)
    return RunState(
        sac=policy,
        replay=Replay(
            joints=np.zeros((rows, joints.shape[-1]), np.float32),
            action=np.zeros((rows, spec.model.nu), np.float32),
            next_joints=np.zeros((rows, joints.shape[-1]), np.float32),
            displacement=np.zeros(rows, np.float32),
            pitch=np.zeros(rows, np.float32),
            slot=np.zeros(rows, np.int32),
            value=np.zeros(rows, np.float32),
        ),
        orders=no_orders(config.robots),
        physics=batch.state,
        previous_qpos=batch.qpos.copy(),
        lying_s=np.zeros(config.robots),
        iteration=np.zeros((), np.int64),
    )


def observation_size(joints: Float[np.ndarray, "robot joint"]) -> int:
    """Features that a tracker's policy sees."""
    still = Command(np.zeros(len(joints), np.int32), np.zeros(len(joints), np.float32))
    return tracker_observation(joints, still, 1.0, 1.0).shape[-1]


def _tracker(state: RunState, config: TrackerConfig) -> Tracker:
    return Tracker(state.sac.averaged_actor, config.commands.max_distance, config.commands.max_speed)


@eqx.filter_jit
def _explore(actor: Actor, joints, command: Command, key: PRNGKeyArray, config: TrackerConfig):
    limits = config.commands
    return actor.sample(tracker_observation(joints, command, limits.max_distance, limits.max_speed), key)[0]
