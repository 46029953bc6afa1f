"""What each robot is told during training, and when it changes (thesis 6.3.3)."""

from functools import partial

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Float, Int, PRNGKeyArray

from rebody.bodies import RobotBatch
from rebody.control.tracker import Command, of_slot
from rebody.tasks import GOAL, VELOCITY
from rebody.training.tracker.commands import Share, ToyGuide
from rebody.training.tracker.config import TrackerConfig
from rebody.training.tracker.schedule import REACHED, Schedule
from rebody.types import AnyArray, GlobalState, Task


class Orders(eqx.Module):
    """One standing order per robot; arrays are written in place."""

    slot: Int[np.ndarray, " robot"]
    value: Float[np.ndarray, " robot"]  # m in the world, m/s, or rad
    steps_left: Int[np.ndarray, " robot"]  # control steps
    age: Int[np.ndarray, " robot"]  # control steps since the robot began anew
    guided: Bool[np.ndarray, " robot"]  # whether a toy ahead of the robot renews the value
    guide_target: Float[np.ndarray, " robot"]  # where that toy is going
    guide_horizon: Int[np.ndarray, " robot"]  # how far it is ahead [decisions]


def no_orders(robots: int) -> Orders:
    """Orders that run out at once."""
    return Orders(
        slot=np.zeros(robots, np.int32),
        value=np.zeros(robots, np.float32),
        steps_left=np.zeros(robots, np.int32),
        age=np.zeros(robots, np.int32),
        guided=np.zeros(robots, bool),
        guide_target=np.zeros(robots, np.float32),
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
        due |= _is_reached(orders, batch) & (rng.random(config.robots) < lasting.change_when_reached)
    if not due.any():
        return
    spec = batch.spec
    pitch = spec.pitch(batch.qpos).astype(np.float32)
    drawn = jax.tree.map(np.asarray, draw_commands(key, pitch, config, lasting.speed_share))
    here = of_slot(drawn.slot, batch.x, pitch)
    shortest, longest = lasting.segment
    new = Orders(
        slot=drawn.slot,
        value=(here + drawn.value).astype(np.float32),
        steps_left=rng.integers(shortest, longest + 1, config.robots).astype(np.int32),
        age=orders.age.copy(),
        guided=(rng.random(config.robots) < config.guided_share) & np.isin(drawn.slot, (GOAL, VELOCITY)),
        # a toy's own goals lie farther off than what a tracker is shown
        guide_target=(here + np.where(drawn.slot == GOAL, 2.0, 1.0) * drawn.value).astype(np.float32),
        guide_horizon=rng.integers(1, config.max_horizon + 1, config.robots).astype(np.int32),
    )
    for old, fresh in zip(jax.tree.leaves(orders), jax.tree.leaves(new), strict=True):
        old[due] = fresh[due]


def _is_reached(orders: Orders, batch: RobotBatch) -> Bool[np.ndarray, " robot"]:
    velocity = batch.qvel[:, batch.spec.x_velocity_address]
    left = commands(orders, batch).value - np.where(orders.slot == VELOCITY, velocity, 0.0)
    return np.abs(left) < REACHED


def follow_guides(orders: Orders, state: GlobalState, config: TrackerConfig) -> None:
    """At a decision, robots with a guide are told where their toy will be."""
    guide = ToyGuide(Task(orders.slot, orders.guide_target), orders.guide_horizon)
    ahead = np.asarray(_guided_value(guide, state, config.max_horizon))
    orders.value[:] = np.where(orders.guided, ahead, orders.value)


def commands(orders: Orders, batch: RobotBatch) -> Command:
    """Orders as the robots see them: a goal in the world becomes a distance."""
    value = orders.value - of_slot(orders.slot, batch.x, batch.spec.pitch(batch.qpos))
    return Command(orders.slot.copy(), value.astype(np.float32))


@partial(jax.jit, static_argnames="config")
def draw_commands(
    key: PRNGKeyArray, pitch: Float[AnyArray, " robot"], config: TrackerConfig, speed_share: Share = 1.0
) -> Command:
    """`CommandDistribution.sample`, compiled."""
    return config.commands.sample(key, pitch, config.reach, speed_share)


@partial(jax.jit, static_argnames="max_horizon")
def _guided_value(guide: ToyGuide, state: GlobalState, max_horizon: int) -> Float[AnyArray, " robot"]:
    return guide.subgoal(state, max_horizon).value
