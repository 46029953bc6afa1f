"""Robots that chase a toy: what a step predictor learns from, and is measured on.

A toy with a scripted policy stands in for the module's: set down where the robot is, it takes one decision towards a
task, and where it then is, or how fast it is, becomes the robot's subgoal. That is how `reuse` makes subgoals with the
thesis' horizon of 1 (5.6.2, 6.4); a predictor thereby belongs to a robot and its tracker, not to a module.
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.agents.controller import TrackerController
from rebody.agents.rollout import follow
from rebody.bodies import RobotBatch
from rebody.control.command import Command, absolute, addressed, relative, slots_among
from rebody.control.sac import Actor, SACBatch
from rebody.control.step_predictor import LOWEST_REWARD, MOST_STEPS, is_predictable, step_reward, steps_of
from rebody.control.tracker import Tracker, tracker_observation
from rebody.tasks import FamilySet
from rebody.tasks.family_set import fit
from rebody.training.step_predictor.config import StepPredictorConfig
from rebody.training.tracker.commands import CommandDistribution, ToyGuide
from rebody.types import POSE_FIELDS, AnyArray, GlobalState, Subgoal, Task

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
    """All of the robots but their physics: the subgoal that each is after; arrays are written in place."""

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


def predictable(families: FamilySet) -> FamilySet:
    """Those of a tracker's that subgoals are given of."""
    return FamilySet(tuple(family for family in families if is_predictable(family)))


def begin(
    batch: RobotBatch, families: FamilySet, chooser: Chooser, config: StepPredictorConfig, key: PRNGKeyArray
) -> Chase:
    """Robots in the batch's positions, at rest, each with a first subgoal."""
    unknown = Task(np.zeros(batch.size, np.int32), np.zeros((batch.size, families.size), np.float32))
    everyone = np.ones(batch.size, bool)
    chase = give(chooser, batch.proprioception(), batch.observe(), unknown, everyone, families, config.tasks, key)
    return jax.tree.map(np.array, chase)


def advance(
    chase: Chase,
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
    families = tracker.families
    follow(TrackerController(tracker), batch, chase.subgoal)
    chase.steps_left[:] -= 1
    fell = batch.fallen
    ended = np.equal(chase.steps_left, 0) | fell
    reward = pay(chase, batch.observe(), fell, families, config.sac.discount)
    batch.reset(rng, fell)
    changes = fell | (rng.random(batch.size) < config.change_probability)
    new = give(chooser, batch.proprioception(), batch.observe(), chase.task, changes, families, config.tasks, key)
    seen = SACBatch(chase.observation, chase.action, reward, new.observation, fell.astype(np.float32))
    transitions = jax.tree.map(lambda leaf: np.asarray(leaf)[ended], seen)
    chase.become(jax.tree.map(np.asarray, new), ended)
    return transitions


@eqx.filter_jit
def give(
    chooser: Chooser,
    joints: Float[AnyArray, "robot joint"],
    state: GlobalState,
    task: Task,
    changes: Bool[AnyArray, " robot"],
    families: FamilySet,
    tasks: CommandDistribution,
    key: PRNGKeyArray,
) -> Chase:
    """A subgoal for every robot, and how long it will be held; robots whose task `changes` get a new task first."""
    task_key, action_key = jax.random.split(key)
    pose, among = state.select(POSE_FIELDS), predictable(families)
    drawn = addressed(absolute(among, tasks.sample(task_key, pose, among), pose), slots_among(among, families))
    task = Task(
        jnp.where(changes, drawn.slot, task.family),
        jnp.where(changes[:, None], fit(drawn.value, families.size), task.target),
    )
    subgoal = ToyGuide(task, jnp.ones_like(task.family)).subgoal(families, state, max_horizon=1)
    command = relative(families, subgoal, pose)
    observation = tracker_observation(joints, command, families)
    action = chooser(observation, action_key)
    return Chase(task, subgoal, command, observation, action, steps_of(action))


@eqx.filter_jit
def pay(
    chase: Chase, state: GlobalState, fell: Bool[AnyArray, " robot"], families: FamilySet, discount: float
) -> Float[AnyArray, " robot"]:
    """What each robot's choice earned if its subgoal ended now.

    All rewards are negative, so that an episode that ends early would look good: a fall is paid as the worst for ever.
    """
    error = families.error(Task(chase.subgoal.slot, chase.subgoal.value), state)
    earned = step_reward(chase.command, error, steps_of(chase.action))
    return jnp.where(fell, LOWEST_REWARD / (1 - discount), earned)
