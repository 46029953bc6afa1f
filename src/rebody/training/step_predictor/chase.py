"""Robots that chase a toy: what a step predictor learns from, and is measured on.

A toy with a scripted policy stands in for the module's: set down where the robot is, it takes one decision towards a
task, and where it then is, or how fast it is, becomes the robot's subgoal. That is how `reuse` makes subgoals with the
thesis' horizon of 1 (5.6.2, 6.4); a predictor thereby belongs to a robot and its tracker, not to a module.
"""

from collections.abc import Callable
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.agents.controller import TrackerController
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch
from rebody.bodies.robot import Reach
from rebody.control.sac import Actor, SACBatch
from rebody.control.step_predictor import LOWEST_REWARD, MOST_STEPS, step_reward, steps_of
from rebody.control.tracker import Command, Tracker, of_slot, relative, tracker_observation
from rebody.tasks import achieved
from rebody.training.step_predictor.config import StepPredictorConfig
from rebody.training.tracker.commands import CommandDistribution, ToyGuide
from rebody.types import AnyArray, GlobalState, Subgoal, Task

Chooser = Callable[[Float[AnyArray, "robot feature"], PRNGKeyArray], Float[AnyArray, "robot 1"]]
"""(what a predictor sees, random key) -> action in [-1, 1] of each robot, see `steps_of`."""


class Exploring(eqx.Module):
    """Samples its actor: for training."""

    actor: Actor

    def __call__(self, observation, key):
        """A sample."""
        return self.actor.sample(observation, key)[0]


class Deciding(eqx.Module):
    """Takes its actor's most likely action: as it will be used."""

    actor: Actor

    def __call__(self, observation, key):
        """Nothing is left to chance."""
        return self.actor(observation)


class Fixed(eqx.Module):
    """Always says the same: a fixed stride, to compare with."""

    steps: Int[AnyArray, ""]

    def __call__(self, observation, key):
        """The middle of that number's share of actions."""
        return jnp.full((len(observation), 1), 2 * (self.steps - 0.5) / MOST_STEPS - 1)


class Chase(eqx.Module):
    """The subgoal that each robot is after; arrays are written in place."""

    task: Task  # to which a toy leads the robot
    subgoal: Subgoal
    command: Command  # the subgoal as the robot saw it when it was given
    observation: Float[AnyArray, "robot feature"]  # at that time
    action: Float[AnyArray, "robot 1"]
    steps_left: Int[AnyArray, " robot"]  # control steps

    def become(self, other: "Chase", who: Bool[np.ndarray, " robot"]) -> None:
        """Take over what those robots are after."""
        for old, new in zip(jax.tree.leaves(self), jax.tree.leaves(other), strict=True):
            old[who] = new[who]


class World(eqx.Module):
    """All of the robots but their physics; arrays are written in place."""

    chase: Chase
    trail: Float[np.ndarray, "step robot nq"]  # joint positions of the last 0.1 s, the oldest first

    def observe(self, batch: RobotBatch) -> GlobalState:
        """Where each robot is; its velocity is that of the last 0.1 s."""
        return batch.spec.observe(self.trail[-1], self.trail[0])


def begin(batch: RobotBatch, reach: Reach, chooser: Chooser, config: StepPredictorConfig, key: PRNGKeyArray) -> World:
    """Robots in the batch's positions, at rest, each with a first subgoal."""
    state = batch.spec.observe(batch.qpos, batch.qpos)
    unknown = Task(np.zeros(batch.size, np.int32), np.zeros(batch.size, np.float32))
    everyone = np.ones(batch.size, bool)
    chase = give(chooser, batch.proprioception(), state, unknown, everyone, reach, config.tasks, key)
    trail = np.repeat(batch.qpos[None], batch.spec.steps_per_decision + 1, axis=0)
    return World(jax.tree.map(np.array, chase), trail)


def advance(
    world: World,
    batch: RobotBatch,
    tracker: Tracker,
    chooser: Chooser,
    config: StepPredictorConfig,
    rng: np.random.Generator,
    key: PRNGKeyArray,
) -> SACBatch:
    """One control step of every robot.

    Returns a transition for each subgoal whose time was up, or that ended in a fall: of any number, even none.
    """
    chase = world.chase
    follow(TrackerController(tracker), batch, chase.subgoal)
    world.trail[:] = np.concatenate([world.trail[1:], batch.qpos[None]])
    chase.steps_left[:] -= 1
    fell = batch.fallen
    ended = np.equal(chase.steps_left, 0) | fell
    reward = pay(chase, world.observe(batch), fell, config.sac.discount)
    stand_up(world, batch, fell, rng)
    changes = fell | (rng.random(batch.size) < config.change_probability)
    now, joints = world.observe(batch), batch.proprioception()
    new = give(chooser, joints, now, chase.task, changes, tracker.reach, config.tasks, key)
    seen = SACBatch(chase.observation, chase.action, reward, new.observation, fell.astype(np.float32))
    transitions = jax.tree.map(lambda leaf: np.asarray(leaf)[ended], seen)
    chase.become(jax.tree.map(np.asarray, new), ended)
    return transitions


def stand_up(world: World, batch: RobotBatch, who: Bool[np.ndarray, " robot"], rng: np.random.Generator) -> None:
    """Those robots begin anew in their rest pose, at rest."""
    batch.reset(rng, who)
    world.trail[:, who] = batch.qpos[who]


@eqx.filter_jit
def give(
    chooser: Chooser,
    joints: Float[AnyArray, "robot joint"],
    state: GlobalState,
    task: Task,
    changes: Bool[AnyArray, " robot"],
    reach: Reach,
    tasks: CommandDistribution,
    key: PRNGKeyArray,
) -> Chase:
    """A subgoal for every robot, and how long it will be held; robots whose task `changes` get a new task first."""
    task_key, action_key = jax.random.split(key)
    drawn = tasks.sample(task_key, state.pitch, replace(reach, pitch=None))
    other = Task(drawn.slot, drawn.value + of_slot(drawn.slot, state.x, state.pitch))
    task = jax.tree.map(lambda new, old: jnp.where(changes, new, old), other, task)
    subgoal = ToyGuide(task, jnp.ones_like(task.family)).subgoal(state, max_horizon=1)
    command = relative(subgoal, state.x, state.pitch)
    observation = tracker_observation(joints, command, reach)
    action = chooser(observation, action_key)
    return Chase(task, subgoal, command, observation, action, steps_of(action))


@eqx.filter_jit
def pay(chase: Chase, state: GlobalState, fell: Bool[AnyArray, " robot"], discount: float) -> Float[AnyArray, " robot"]:
    """What each robot's choice earned if its subgoal ended now.

    All rewards are negative, so that an episode that ends early would look good: a fall is paid as the worst for ever.
    """
    error = achieved(chase.subgoal.slot, state) - chase.subgoal.value
    earned = step_reward(chase.command, error, steps_of(chase.action))
    return jnp.where(fell, LOWEST_REWARD / (1 - discount), earned)
