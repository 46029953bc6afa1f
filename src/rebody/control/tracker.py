"""The tracker ("transfer function" in the thesis, 5.5): (joint state, subgoal) -> joint action.

A command is the subgoal as the robot sees it: a goal relative to where the robot is now, cut to the
trained distance, or a speed. One network serves all slots (5.6).
"""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float, Int

from rebody.control.sac import Actor
from rebody.tasks.families import GOAL
from rebody.types import AnyArray

SLOTS = ("goal", "velocity")
"""Families that a command can address, by index."""


class Command(eqx.Module):
    """A subgoal relative to the robot."""

    slot: Int[AnyArray, "*batch"]
    value: Float[AnyArray, "*batch"]  # goal: m ahead of the robot; velocity: m/s


@dataclass(frozen=True)
class TrackerReward:
    """What a tracker is paid per control step."""

    distance: float = 0.2
    """Per metre from the goal."""
    arrival: float = 0.5
    """Paid in full on the goal, half at 0.1 m: pulls the last centimetres."""
    speed: float = 0.4
    """Per m/s from the wanted speed."""
    upright: float = 0.5
    """Times 1 - cos(pitch): a robot must not end on its back."""
    energy: float = 0.02
    """Times the mean squared action: a robot that has arrived stands still."""


class Tracker(eqx.Module):
    """A policy for one robot, with its fixed input scaling."""

    actor: Actor
    max_distance: float = eqx.field(static=True)
    max_speed: float = eqx.field(static=True)

    def __call__(self, joints: Float[AnyArray, "*batch joint"], command: Command) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""
        return self.actor(tracker_observation(joints, command, self.max_distance, self.max_speed))


def tracker_observation(
    joints: Float[AnyArray, "*batch joint"], command: Command, max_distance: float, max_speed: float
) -> Float[AnyArray, "*batch feature"]:
    """Joint state and command, the goal on three scales so that centimetres count as metres do."""
    is_goal = (command.slot == GOAL).astype(joints.dtype)
    ahead = is_goal * jnp.clip(command.value, -max_distance, max_distance)
    speed = (1 - is_goal) * jnp.clip(command.value, -max_speed, max_speed)
    features = [is_goal, 1 - is_goal, ahead / max_distance, jnp.tanh(2 * ahead), jnp.tanh(10 * ahead), speed]
    return jnp.concatenate([joints, jnp.stack(features, axis=-1)], axis=-1)


def tracker_reward(
    command: Command,
    displacement: Float[AnyArray, "*batch"],
    control_dt: float,
    pitch: Float[AnyArray, "*batch"],
    action: Float[AnyArray, "*batch action"],
    weights: TrackerReward,
) -> Float[AnyArray, "*batch"]:
    """Pay for one control step that moved the robot by `displacement` [m] and left it at `pitch` [rad].

    Linear in the error, so that standing still is never the best answer to a speed; a pull on arrival.
    """
    miss = jnp.abs(command.value - displacement)
    goal = weights.arrival * 0.1 / (0.1 + miss) - weights.distance * miss
    velocity = -weights.speed * jnp.abs(command.value - displacement / control_dt)
    posture = -weights.upright * (1 - jnp.cos(pitch)) - weights.energy * jnp.mean(action**2, axis=-1)
    return jnp.where(command.slot == GOAL, goal, velocity) + posture
