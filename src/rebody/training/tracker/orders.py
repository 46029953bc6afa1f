"""What each robot is told during training, and when it changes (thesis 6.3.3)."""

from collections.abc import Callable
from functools import partial

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.bodies import RobotBatch
from rebody.control.command import Command, absolute, relative
from rebody.tasks import Family, FamilySet
from rebody.tasks.quantities import length
from rebody.training.tracker.commands import Share, ToyGuide, is_guided
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.schedule import REACHED, Schedule
from rebody.types import AnyArray, GlobalState, Pose, Subgoal, Task


class Orders(eqx.Module):
    """One standing order per robot; arrays are written in place."""

    slot: Int[np.ndarray, " robot"]
    value: Float[np.ndarray, "robot axis"]  # in the world, in the units of its slot's quantity
    steps_left: Int[np.ndarray, " robot"]  # control steps
    age: Int[np.ndarray, " robot"]  # control steps since the robot began anew
    guided: Bool[np.ndarray, " robot"]  # whether a toy ahead of the robot renews the value
    guide_target: Float[np.ndarray, "robot axis"]  # where that toy is going
    guide_horizon: Int[np.ndarray, " robot"]  # how far it is ahead [decisions]


def no_orders(robots: int, families: FamilySet) -> Orders:
    """Orders that run out at once."""
    return Orders(
        slot=np.zeros(robots, np.int32),
        value=np.zeros((robots, families.size), np.float32),
        steps_left=np.zeros(robots, np.int32),
        age=np.zeros(robots, np.int32),
        guided=np.zeros(robots, bool),
        guide_target=np.zeros((robots, families.size), np.float32),
        guide_horizon=np.ones(robots, np.int32),
    )


def renew(
    orders: Orders,
    batch: RobotBatch,
    config: TrackerConfig,
    lasting: Schedule,
    rng: np.random.Generator,
    key: PRNGKeyArray,
):
    """Count one control step, and give a new order where the old one has run out."""
    orders.steps_left[:] -= 1
    orders.age[:] += 1
    due = orders.steps_left < 0
    if lasting.change_when_reached:
        due |= _is_reached(orders, batch, config.families) & (rng.random(config.robots) < lasting.change_when_reached)
    if not due.any():
        return
    families, pose = config.families, batch.pose().astype(np.float32)
    drawn = jax.tree.map(np.asarray, draw_commands(key, pose, config, lasting.speed_share))
    shortest, longest = lasting.segment
    new = Orders(
        slot=drawn.slot,
        value=np.asarray(absolute(families, drawn, pose).value, np.float32),
        steps_left=rng.integers(shortest, longest + 1, config.robots).astype(np.int32),
        age=orders.age.copy(),
        guided=(rng.random(config.robots) < config.guided_share) & _among(families, is_guided)[drawn.slot],
        guide_target=np.asarray(absolute(families, _farther(families, drawn), pose).value, np.float32),
        guide_horizon=rng.integers(1, config.max_horizon + 1, config.robots).astype(np.int32),
    )
    for old, fresh in zip(jax.tree.leaves(orders), jax.tree.leaves(new), strict=True):
        old[due] = fresh[due]


def _farther(families: FamilySet, drawn: Command) -> Command:
    """Where a guide is going: a toy's own goals lie farther off than what a tracker is shown."""
    times = np.where(_among(families, lambda family: family.is_pose)[drawn.slot], 2.0, 1.0)
    return Command(drawn.slot, times[:, None] * drawn.value)


def _among(families: FamilySet, holds: Callable[[Family], bool]) -> Bool[np.ndarray, " slot"]:
    """Of which slots something holds."""
    return np.array([holds(family) for family in families])


def _is_reached(orders: Orders, batch: RobotBatch, families: FamilySet) -> Bool[np.ndarray, " robot"]:
    return np.asarray(length(families.error(Task(orders.slot, orders.value), batch.observe())) < REACHED)


def follow_guides(orders: Orders, state: GlobalState, config: TrackerConfig) -> None:
    """At a decision, robots with a guide are told where their toy will be."""
    guide = ToyGuide(Task(orders.slot, orders.guide_target), orders.guide_horizon)
    ahead = np.asarray(_guided_value(guide, config.families, state, config.max_horizon))
    orders.value[:] = np.where(orders.guided[:, None], ahead, orders.value)


def commands(orders: Orders, batch: RobotBatch, families: FamilySet) -> Command:
    """Orders as the robots see them: a goal in the world becomes a distance."""
    order = Subgoal(orders.slot.copy(), orders.value.copy())
    return relative(families, order, batch.pose().astype(np.float32))


@partial(jax.jit, static_argnames="config")
def draw_commands(key: PRNGKeyArray, pose: Pose, config: TrackerConfig, speed_share: Share = 1.0) -> Command:
    """`CommandDistribution.sample`, compiled."""
    return config.commands.sample(key, pose, config.families, speed_share)


@partial(jax.jit, static_argnames=("families", "max_horizon"))
def _guided_value(
    guide: ToyGuide, families: FamilySet, state: GlobalState, max_horizon: int
) -> Float[AnyArray, "robot axis"]:
    return guide.subgoal(families, state, max_horizon).value
