"""Training a tracker with soft actor-critic (thesis 5.5, 6.3.3).

Many robots follow changing orders; half of every batch is learned from under commands that were never
given, since the reward of any command follows from how the robot moved.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PRNGKeyArray

from rebody.agents.parts import load_tracker
from rebody.bodies import RobotBatch
from rebody.control.command import Command, Motion, after
from rebody.control.sac import Actor, SACBatch, SACState
from rebody.control.tracker import Tracker, tracker_observation, tracker_reward
from rebody.errors import RebodyError
from rebody.jax_settings import own_jax_settings
from rebody.training.motion import motion_of, no_command, tracker_features
from rebody.training.off_policy import Learner, OffPolicyState, learn, ready_robot, train
from rebody.training.run import Run
from rebody.training.tracker.commands import Share
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.orders import Orders, commands, follow_guides, no_orders, renew
from rebody.training.tracker.report import measure, save_tracker
from rebody.training.tracker.schedule import schedule, speed_share
from rebody.types import POSE_FIELDS, AnyArray


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
    spec = ready_robot(robot, config)
    only, slots = config.commands.only, config.families.names
    if only not in (None, *slots):
        raise RebodyError(f"'{spec.name}' is not trained for slot '{only}'; it has: {', '.join(slots)}.")
    settings = {"robot": robot, "seed": seed}
    return train(TrackerLearner(spec, config), out, settings, resume=resume, finish=finish, init_from=init_from)


class ControlSteps(eqx.Module):
    """Transitions as the replay buffer holds them: the reward follows from the command, which may be another."""

    joints: Float[AnyArray, "*size joint"]
    action: Float[AnyArray, "*size action"]
    next_joints: Float[AnyArray, "*size joint"]
    motion: Motion
    command: Command  # before the step


class World(eqx.Module):
    """What is known of the robots beside their physics."""

    orders: Orders


@dataclass(frozen=True)
class TrackerLearner(Learner[World]):
    """(joint state, command) -> joint action."""

    name = "tracker"
    config: TrackerConfig

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """Joint state and command, and the robot's actuators."""
        return tracker_features(batch, self.config.families), self.spec.model.nu

    def row(self, batch: RobotBatch) -> ControlSteps:
        """What happened, whatever was asked for."""
        joints, still = batch.proprioception()[:1], np.zeros((1, len(POSE_FIELDS)), np.float32)
        action = np.zeros((1, self.spec.model.nu), np.float32)
        motion = Motion(still, still, still, np.zeros(1, bool))
        return ControlSteps(joints, action, joints, motion, no_command(1, self.config.families))

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> World:
        """Robots without orders."""
        return World(no_orders(batch.size, self.config.families))

    def collect(
        self, state: OffPolicyState[World], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[World, dict[str, Any]]:
        """Control steps under orders; what they earned, and how often robots fell."""
        config, spec, orders = self.config, self.spec, state.world.orders
        lasting = schedule(config, int(state.iteration), spec.control_dt)
        for step in range(config.steps):
            order_key, action_key = jax.random.split(jax.random.fold_in(key, step))
            renew(orders, batch, config, lasting, rng, order_key)
            if step % spec.steps_per_decision == 0:
                follow_guides(orders, batch.observe(), config)
            push(batch, config, rng)
            joints, before, command = batch.proprioception(), batch.pose(), commands(orders, batch, config.families)
            action = np.asarray(_explore(state.sac.actor, joints, command, action_key, config))
            batch.step(action)
            seen = ControlSteps(joints, action, batch.proprioception(), motion_of(batch, before), command)
            state.replay.append(seen)
            begin_anew(state.world, batch, batch.fallen | (orders.age >= lasting.trajectory), rng)
        newest = state.replay.newest(config.steps * config.robots)
        return state.world, experience(newest, config, spec.control_dt)

    def update(self, policy: SACState, drawn: Any, key: PRNGKeyArray, iteration: int) -> tuple[SACState, dict]:
        """Half of every batch learns under commands that were never given."""
        share = jnp.asarray(speed_share(self.config, iteration))  # a number would be compiled anew whenever it changes
        return learn(policy, drawn, key, self.config.sac, Relabelling(self.config, self.spec.control_dt, share))

    def measure(self, actor: Actor) -> dict[str, float]:
        """Errors, falls."""
        return measure(Tracker(actor, self.config.families), self.spec, self.config)

    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """A tracker's artifact."""
        return save_tracker(Tracker(actor, self.config.families), figures, self.spec, self.config, run)

    def load_actor(self, artifact: str) -> Actor:
        """That of a tracker."""
        return load_tracker(artifact).tracker.actor


class Relabelling(eqx.Module):
    """Transitions with their own command or a new one, and the reward that it would have brought.

    A command is taken to last: afterwards the same goal in the world is nearer, a speed is the same.
    """

    config: TrackerConfig
    control_dt: float
    speed_share: Share = 1.0

    def __call__(self, steps: ControlSteps, key: PRNGKeyArray) -> SACBatch:
        """A batch to learn from."""
        config, motion, action, families = self.config, steps.motion, steps.action, self.config.families
        size, before = len(motion.fell), motion.pose - motion.displacement  # right but for places, drawn as distances
        fresh = config.commands.sample(key, before, families, self.speed_share)
        renewed = jnp.arange(size) < config.relabelled * size
        command = Command(
            jnp.where(renewed, fresh.slot, steps.command.slot),
            jnp.where(renewed[:, None], fresh.value, steps.command.value),
        )
        return SACBatch(
            observation=tracker_observation(steps.joints, command, families),
            action=action,
            reward=tracker_reward(command, motion, self.control_dt, action, families, config.reward),
            next_observation=tracker_observation(steps.next_joints, after(families, command, motion), families),
            terminal=motion.fell.astype(jnp.float32),
        )


@eqx.filter_jit
def experience(seen: ControlSteps, config: TrackerConfig, control_dt: float) -> dict[str, Float[AnyArray, ""]]:
    """What was earned per control step, and how long robots stayed on their feet (thesis, figure 6.12)."""
    reward = tracker_reward(seen.command, seen.motion, control_dt, seen.action, config.families, config.reward)
    seconds = seen.motion.fell.size * control_dt
    return {"reward": reward.mean(), "falls_per_minute": 60 * seen.motion.fell.sum() / seconds}


def push(batch: RobotBatch, config: TrackerConfig, rng: np.random.Generator) -> None:
    """Now and then something changes a robot's speed."""
    is_pushed = rng.random(batch.size) < batch.spec.control_dt / config.push_every_s
    batch.push(np.where(is_pushed, rng.uniform(-config.push, config.push, batch.size), 0.0))


def begin_anew(world: World, batch: RobotBatch, who: Bool[np.ndarray, " robot"], rng: np.random.Generator) -> None:
    """Robots that have fallen, or moved for long enough, go back to their rest pose, and get a new order."""
    batch.reset(rng, who)
    world.orders.steps_left[who] = 0
    world.orders.age[who] = 0


@eqx.filter_jit
def _explore(actor: Actor, joints, command: Command, key: PRNGKeyArray, config: TrackerConfig):
    return actor.sample(tracker_observation(joints, command, config.families), key)[0]
