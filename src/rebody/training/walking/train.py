"""Training a walking policy with soft actor-critic: (what a robot feels, joystick command) -> joint targets.

Many robots follow changing commands; half of every batch is learned from under commands that were never given, and half
of it as a mirror shows it, where left and right are alike.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, PRNGKeyArray

from rebody.bodies import RobotBatch
from rebody.bodies.walking.batch import JointBatch, joint_interface
from rebody.bodies.walking.joints import JointInterface
from rebody.control.sac import Actor, SACState
from rebody.jax_settings import own_jax_settings
from rebody.ranges import Box
from rebody.training.off_policy import Learner, OffPolicyState, explore, learn, ready_robot, train
from rebody.training.run import Run
from rebody.training.walking.config import WalkingConfig
from rebody.training.walking.follower import ActorFollower
from rebody.training.walking.measure import measure
from rebody.training.walking.mirror import mirror_of
from rebody.training.walking.relabelling import ControlSteps, Relabelling, command_columns, experience
from rebody.training.walking.report import save_walking
from rebody.training.walking.scales import input_scales, loaded_actor
from rebody.training.walking.stride import Stride, stride_of


@own_jax_settings()
def train_walking(
    robot: str,
    config: WalkingConfig,
    out: Path,
    seed: int,
    *,
    resume: bool = False,
    finish: bool = False,
    init_from: str | None = None,
) -> Path:
    """Train a walking policy; returns the artifact's folder.

    RebodyError if the robot is not ready or follows no joystick, `out` holds another run, or `init_from` has other
    sizes; Interrupted on Ctrl-C.
    """
    spec = ready_robot(robot, config)
    learner = WalkingLearner(spec, config)
    return train(learner, out, {"robot": robot, "seed": seed}, resume=resume, finish=finish, init_from=init_from)


class World(eqx.Module):
    """What is known of the robots beside their physics; arrays are written in place."""

    command: Float[np.ndarray, "robot 3"]
    steps_left: Float[np.ndarray, " robot"]  # of the command
    speed: Float[np.ndarray, "robot 3"]  # a running mean [m/s, m/s, rad/s]


@dataclass(frozen=True)
class WalkingLearner(Learner[World]):
    """(what it feels, joystick command) -> joint targets."""

    name = "walking"
    config: WalkingConfig

    @cached_property
    def joints(self) -> JointInterface:
        """What it hears and moves."""
        return joint_interface(self.spec)

    @property
    def limits(self) -> Box:
        """Commands that it is to follow."""
        assert self.spec.walking is not None
        return self.spec.walking.joystick.limits

    def simulate(self, size: int) -> JointBatch:
        """Robots whose actions are joint targets."""
        return JointBatch(self.spec, size)

    def sizes(self, batch: RobotBatch) -> tuple[int, int]:
        """What it hears, and its joints."""
        return self.joints.observations, batch.actions

    def row(self, batch: RobotBatch) -> ControlSteps:
        """What happened, whatever was commanded."""
        hears, joints = self.sizes(batch)
        seen, action, way = (np.zeros((1, size), np.float32) for size in (hears, joints, 3))
        scalar = np.zeros(1, np.float32)
        return ControlSteps(
            seen, action, action, seen, Stride(way, scalar, scalar, scalar, scalar, np.zeros(1, bool)), way
        )

    def begin(self, batch: RobotBatch, actor: Actor, key: PRNGKeyArray) -> World:
        """Robots without commands."""
        none = np.zeros((batch.size, 3), np.float32)
        return World(none, np.zeros(batch.size, np.float32), none.copy())

    def collect(
        self, state: OffPolicyState[World], batch: RobotBatch, rng: np.random.Generator, key: PRNGKeyArray
    ) -> tuple[World, dict[str, Any]]:
        """Control steps under changing commands; what they earned, and how often robots fell."""
        assert isinstance(batch, JointBatch)
        config, world, scales = self.config, state.world, input_scales(batch.joints)
        for step in range(config.steps):
            command_key, action_key = jax.random.split(jax.random.fold_in(key, step))
            renew(world, self, rng, command_key)
            push(batch, config, rng)
            seen, last_action, before = batch.hear(world.command), batch.gait.last_action, (batch.pose(), batch.feet)
            action = np.asarray(explore(state.sac.actor, seen * scales, action_key))
            batch.step(action)
            stride, command = stride_of(batch, before, world.speed, config.smoothing_s), world.command.copy()
            state.replay.append(ControlSteps(seen, action, last_action, batch.hear(command), stride, command))
            begin_anew(world, batch, batch.fallen, rng)
        newest = state.replay.newest(config.steps * config.robots)
        return world, experience(newest, config, self.spec.control_dt)

    def update(self, policy: SACState, drawn: Any, key: PRNGKeyArray, iteration: int) -> tuple[SACState, dict]:
        """Half of every batch learns under commands that were never given."""
        assert self.spec.walking is not None
        joints = self.joints
        mirror = mirror_of(joints, self.spec.walking.mirror, self.spec.name)
        grown = min(1.0, iteration / max(1, self.config.drag_iterations))
        share = jnp.asarray(grown)  # a number would be compiled anew whenever it changes
        told = Relabelling(self.config, self.limits, input_scales(joints), command_columns(joints), mirror, share)
        return learn(policy, drawn, key, self.config.sac, told)

    def measure(self, actor: Actor) -> dict[str, float]:
        """Errors, falls."""
        return measure(ActorFollower(self.spec, self.config.held_out, actor), self.limits, self.config.held_out_s)

    def save(self, actor: Actor, figures: dict[str, float], run: Run) -> Path:
        """A walking policy's artifact."""
        return save_walking(actor, self.spec, self.config, run)

    def load_actor(self, artifact: str) -> Actor:
        """That of a walking policy."""
        return loaded_actor(artifact, self.joints, self.config.sac)


def renew(world: World, learner: WalkingLearner, rng: np.random.Generator, key: PRNGKeyArray) -> None:
    """Count one control step, and give a new command where the old one has run out."""
    world.steps_left[:] -= 1
    due = world.steps_left < 0
    if not due.any():
        return
    config, dt = learner.config, learner.spec.control_dt
    world.command[due] = np.asarray(_draw(key, len(due), learner.limits, config))[due]
    shortest, longest = (round(seconds / dt) for seconds in config.segment_s)
    world.steps_left[due] = rng.integers(shortest, longest + 1, due.sum())


def push(batch: JointBatch, config: WalkingConfig, rng: np.random.Generator) -> None:
    """Now and then something changes a robot's speed."""
    is_pushed = rng.random(batch.size) < batch.spec.control_dt / config.push_every_s
    batch.push(np.where(is_pushed[:, None], rng.uniform(-config.push, config.push, (batch.size, 2)), 0.0))


def begin_anew(world: World, batch: JointBatch, who: Bool[np.ndarray, " robot"], rng: np.random.Generator) -> None:
    """Robots that have fallen go back to their rest pose, and get a new command."""
    if not who.any():
        return
    batch.reset(rng, who)
    world.steps_left[who] = 0
    world.speed[who] = 0.0


@eqx.filter_jit
def _draw(key: PRNGKeyArray, size: int, limits: Box, config: WalkingConfig):
    return config.commands.sample(key, size, limits)
