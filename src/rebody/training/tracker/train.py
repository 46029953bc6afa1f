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
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.agents.parts import load_tracker
from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.check import require_ready
from rebody.control import sac
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.control.tracker import Command, Motion, Tracker, after, slots_of, tracker_observation, tracker_reward
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.ranges import check_ranges
from rebody.training.motion import motion_of
from rebody.training.ring import draw, newest, write
from rebody.training.run import Metrics, Run
from rebody.training.tracker.commands import Share
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.orders import Orders, commands, follow_guides, no_orders, renew
from rebody.training.tracker.report import measure, save_tracker
from rebody.training.tracker.schedule import schedule, speed_share
from rebody.types import AnyArray


class Replay(eqx.Module):
    """Transitions of control steps: a ring in host memory, written in place, or batches drawn from it."""

    joints: Float[AnyArray, "*size joint"]
    action: Float[AnyArray, "*size action"]
    next_joints: Float[AnyArray, "*size joint"]
    motion: Motion
    command: Command  # before the step


class RunState(eqx.Module):
    """Everything that a resumed run needs; host arrays are written in place."""

    sac: SACState
    replay: Replay
    orders: Orders
    physics: Float[np.ndarray, "robot state"]
    previous_qpos: Float[np.ndarray, "robot nq"]  # at the last decision
    iteration: Int[np.ndarray, ""]


@own_jax_settings()
def train_tracker(
    robot: str,
    config: TrackerConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a tracker; returns the artifact's folder.

    RebodyError if the robot is not ready, `out` holds another run, `init_from` has other sizes, or the robot has no
    such slot as the only one asked for; Interrupted on Ctrl-C.
    """
    check_ranges(config)
    spec = load_robot(robot)
    require_ready(spec)
    only, slots = config.commands.only, slots_of(config.reach)
    if only not in (None, *slots):
        raise RebodyError(f"'{spec.name}' is not trained for slot '{only}'; it has: {', '.join(slots)}.")
    with Run(
        out, asdict(config) | {"robot": robot, "seed": seed, "init_from": init_from}, resume=resume, finish=finish
    ) as run:
        batch = RobotBatch(spec, config.robots)
        batch.reset(np.random.default_rng((seed, 1)))
        state = run.restore(initial_state(config, batch, jax.random.key(seed), init_from))
        batch.state = state.physics
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
    share = jnp.asarray(speed_share(config, iteration))  # a number would be compiled anew whenever it changes
    policy, metrics = learn(state.sac, transitions, learn_key, config, batch.spec.control_dt, share)
    metrics |= experience(newest(state.replay, written, config.steps * config.robots), config, batch.spec.control_dt)
    state = eqx.tree_at(
        lambda s: (s.sac, s.physics, s.iteration),
        state,
        (policy, batch.state, state.iteration + 1),
    )
    if (iteration + 1) % config.evaluate_every == 0:
        figures = measure(_tracker(state, config), batch.spec)
        metrics |= {f"evaluation/{name}": value for name, value in figures.items()}
    return state, {name: float(value) for name, value in metrics.items()}


def collect(
    state: RunState, batch: RobotBatch, config: TrackerConfig, rng: np.random.Generator, key: PRNGKeyArray
) -> None:
    """Move every robot by `config.steps` control steps under its orders; write the replay in place."""
    spec, orders = batch.spec, state.orders
    lasting = schedule(config, int(state.iteration), spec.control_dt)
    first_row = int(state.iteration) * config.steps * config.robots
    for step in range(config.steps):
        order_key, action_key = jax.random.split(jax.random.fold_in(key, step))
        renew(orders, batch, config, lasting, rng, order_key)
        if step % spec.steps_per_decision == 0:
            follow_guides(orders, spec.observe(batch.qpos, state.previous_qpos), config)
            state.previous_qpos[:] = batch.qpos
        push(batch, config, rng)
        joints, before, command = batch.tracker_state(), batch.qpos.copy(), commands(orders, batch)
        action = np.asarray(_explore(state.sac.actor, joints, command, action_key, config))
        batch.step(action)
        seen = Replay(
            joints=joints,
            action=action,
            next_joints=batch.tracker_state(),
            motion=motion_of(batch, before),
            command=command,
        )
        write(state.replay, first_row + step * config.robots, seen)
        begin_anew(state, batch, batch.fallen | (orders.age >= lasting.trajectory), rng)


@eqx.filter_jit
def experience(seen: Replay, config: TrackerConfig, control_dt: float) -> dict[str, Float[AnyArray, ""]]:
    """What was earned per control step, and how long robots stayed on their feet (thesis, figure 6.12)."""
    reward = tracker_reward(seen.command, seen.motion, control_dt, seen.action, config.reach, config.reward)
    seconds = seen.motion.fell.size * control_dt
    return {"reward": reward.mean(), "falls_per_minute": 60 * seen.motion.fell.sum() / seconds}


def push(batch: RobotBatch, config: TrackerConfig, rng: np.random.Generator) -> None:
    """Now and then something changes a robot's speed."""
    is_pushed = rng.random(batch.size) < batch.spec.control_dt / config.push_every_s
    batch.push(np.where(is_pushed, rng.uniform(-config.push, config.push, batch.size), 0.0))


def begin_anew(state: RunState, batch: RobotBatch, who: Bool[np.ndarray, " robot"], rng: np.random.Generator) -> None:
    """Robots that have fallen, or moved for long enough, go back to their rest pose, and get a new order."""
    batch.reset(rng, who)
    state.orders.steps_left[who] = 0
    state.orders.age[who] = 0
    state.previous_qpos[who] = batch.qpos[who]


@eqx.filter_jit
def learn(
    policy: SACState, transitions: Replay, key: PRNGKeyArray, config: TrackerConfig, control_dt: float, share: Share
) -> tuple[SACState, dict[str, Float[AnyArray, ""]]]:
    """One update of soft actor-critic per batch."""

    def batch_of(transitions: Replay, key: PRNGKeyArray) -> SACBatch:
        return relabel(transitions, key, config, control_dt, share)

    return sac.update_many(policy, batch_of, transitions, jax.random.split(key, config.updates), config.sac)


def relabel(
    transitions: Replay, key: PRNGKeyArray, config: TrackerConfig, control_dt: float, share: Share = 1.0
) -> SACBatch:
    """Transitions with their own command or a new one, and the reward that it would have brought.

    A command is taken to last: afterwards the same goal in the world is nearer, a speed is the same.
    """
    motion, action, reach = transitions.motion, transitions.action, config.reach
    size = len(motion.pitch)
    fresh = config.commands.sample(key, motion.pitch - motion.turn, reach, share)
    renewed = jnp.arange(size) < config.relabelled * size
    command = jax.tree.map(lambda new, old: jnp.where(renewed, new, old), fresh, transitions.command)
    return SACBatch(
        observation=tracker_observation(transitions.joints, command, reach),
        action=action,
        reward=tracker_reward(command, motion, control_dt, action, reach, config.reward),
        next_observation=tracker_observation(transitions.next_joints, after(command, motion), reach),
        terminal=motion.fell.astype(jnp.float32),
    )


def initial_state(
    config: TrackerConfig, batch: RobotBatch, key: PRNGKeyArray, init_from: str | None = None
) -> RunState:
    """Robots without orders, an empty replay, a fresh policy or that of an artifact."""
    spec, rows = batch.spec, config.replay
    joints = batch.tracker_state()
    still = Command(np.zeros(len(joints), np.int32), np.zeros(len(joints), np.float32))
    moved = np.zeros(rows, np.float32)
    observed = tracker_observation(joints, still, config.reach).shape[-1]
    policy = sac.initial_state(observed, spec.model.nu, config.sac, key)
    if init_from is not None:
        policy = sac.take_over(policy, load_tracker(init_from).tracker.actor, init_from)
    return RunState(
        sac=policy,
        replay=Replay(
            joints=np.zeros((rows, joints.shape[-1]), np.float32),
            action=np.zeros((rows, spec.model.nu), np.float32),
            next_joints=np.zeros((rows, joints.shape[-1]), np.float32),
            motion=Motion(moved.copy(), moved.copy(), moved.copy(), moved.copy(), np.zeros(rows, bool), moved),
            command=Command(np.zeros(rows, np.int32), np.zeros(rows, np.float32)),
        ),
        orders=no_orders(config.robots),
        physics=batch.state,
        previous_qpos=batch.qpos.copy(),
        iteration=np.zeros((), np.int64),
    )


def _tracker(state: RunState, config: TrackerConfig) -> Tracker:
    return Tracker(state.sac.averaged_actor, config.reach)


@eqx.filter_jit
def _explore(actor: Actor, joints, command: Command, key: PRNGKeyArray, config: TrackerConfig):
    return actor.sample(tracker_observation(joints, command, config.reach), key)[0]
