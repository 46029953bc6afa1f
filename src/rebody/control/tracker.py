"""The tracker ("transfer function" in the thesis, 5.5): (joint state, subgoal) -> joint action.

A command is the subgoal as the robot sees it: a goal or a pitch relative to where the robot is now, cut to what it
was trained for, or a speed. One network serves all slots (5.6).
"""

from dataclasses import dataclass

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.bodies.robot import Reach
from rebody.control.sac import Actor
from rebody.ranges import NotNegative
from rebody.tasks.families import GOAL, JUMP, STAND, family_index
from rebody.types import AnyArray, Subgoal

MARGIN = 1.1
"""Trackers are trained on commands that go beyond a robot's reach by this factor, and cut farther ones to it."""
LOWEST_JUMP = 0.5
"""Slowest jump that is paid in full [m/s]; one of 0 is none."""


class Command(eqx.Module):
    """A subgoal relative to the robot."""

    slot: Int[AnyArray, "*batch"]  # index into `rebody.tasks.FAMILIES`
    value: Float[AnyArray, "*batch"]  # goal: m ahead of the robot; velocity, jump: m/s; stand: rad to turn


class Motion(eqx.Module):
    """What a control step did to the robot."""

    displacement: Float[AnyArray, "*batch"]  # m
    turn: Float[AnyArray, "*batch"]  # rad
    pitch: Float[AnyArray, "*batch"]  # rad, afterwards
    pace: Float[AnyArray, "*batch"]  # m/s, afterwards: the speed of this step, or a mean over the last ones
    fell: Bool[AnyArray, "*batch"]
    rise: Float[AnyArray, "*batch"]  # m


@dataclass(frozen=True)
class TrackerReward:
    """What a tracker is paid per control step."""

    distance: NotNegative = 0.2
    """Per metre from the goal."""
    arrival: NotNegative = 0.5
    """Paid in full on a goal or pitch, half at 0.1 m or rad: pulls the last centimetres."""
    speed: NotNegative = 0.4
    """Per m/s from the wanted speed."""
    turn: NotNegative = 0.5
    """Per rad from the wanted pitch."""
    overshoot: NotNegative = 4.0
    """Of a jump, which is paid by the square of its share of the wanted vertical speed: price of each share beyond.
    The square makes one high jump worth more than many low ones."""
    relative: NotNegative = 0.0
    """Paid in full at the wanted speed, less by the error relative to it; a far goal is the speed that leads there.
    In place of `distance` and `speed` where a robot must learn to walk first."""
    alive: NotNegative = 0.0
    """Paid as long as it has not fallen."""
    upright: NotNegative = 0.5
    """Times 1 - cos(pitch), where no pitch is asked for: a robot must not end on its back."""
    energy: NotNegative = 0.02
    """Times the mean squared action: a robot that has arrived stands still."""


class Tracker(eqx.Module):
    """A policy for one robot, with its fixed input scaling."""

    actor: Actor
    reach: Reach = eqx.field(static=True)

    @property
    def joints(self) -> int:
        """Size of the joint state that it sees."""
        nothing = Command(np.zeros((), np.int32), np.zeros((), np.float32))
        return self.actor.observations - tracker_observation(np.zeros(0, np.float32), nothing, self.reach).size

    @property
    def slots(self) -> tuple[str, ...]:
        """Families that a command can address."""
        return slots_of(self.reach)

    def __call__(self, joints: Float[AnyArray, "*batch joint"], command: Command) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""
        return self.actor(tracker_observation(joints, command, self.reach))


def slots_of(reach: Reach) -> tuple[str, ...]:
    """Families that a robot of that reach can be commanded in, by index."""
    return tuple(reach.limits)


def relative(subgoal: Subgoal, x: Float[AnyArray, "*batch"], pitch: Float[AnyArray, "*batch"]) -> Command:
    """A subgoal as the robot sees it now: a goal is a point in the world, so its distance shrinks [m, rad]."""
    return Command(subgoal.slot, jnp.subtract(subgoal.value, of_slot(subgoal.slot, x, pitch)))


def after(command: Command, motion: Motion) -> Command:
    """The same subgoal as it is seen after a motion."""
    return Command(command.slot, jnp.subtract(command.value, of_slot(command.slot, motion.displacement, motion.turn)))


def of_slot(slot: Int[AnyArray, "*batch"], x: Float[AnyArray, "*batch"], pitch: Float[AnyArray, "*batch"]):
    """What a slot is about, [*batch]: x [m] for goals, pitch [rad] for stands, else 0; of NumPy or JAX."""
    return (slot == GOAL) * x + (slot == STAND) * pitch


def tracker_observation(
    joints: Float[AnyArray, "*batch joint"], command: Command, reach: Reach
) -> Float[AnyArray, "*batch feature"]:
    """Joint state and command, what is to be reached on three scales so that centimetres count as metres do."""
    far, (slowest, fastest) = MARGIN * reach.distance, (MARGIN * limit for limit in reach.speed)
    is_slot = {name: (command.slot == family_index(name)).astype(joints.dtype) for name in slots_of(reach)}
    ahead = is_slot["goal"] * jnp.clip(command.value, -far, far)
    speed = is_slot["velocity"] * jnp.clip(command.value, slowest, fastest)
    features = [*is_slot.values(), ahead / far, jnp.tanh(2 * ahead), jnp.tanh(10 * ahead), speed]
    if reach.pitch is not None:
        turn = is_slot["stand"] * command.value
        features += [turn, jnp.tanh(2 * turn), jnp.tanh(10 * turn)]
    if reach.jump is not None:
        features.append(is_slot["jump"] * jnp.clip(command.value, 0.0, MARGIN * reach.jump[1]))
    return jnp.concatenate([joints, jnp.stack(features, axis=-1)], axis=-1)


def tracker_reward(
    command: Command,
    motion: Motion,
    control_dt: float,
    action: Float[AnyArray, "*batch action"],
    reach: Reach,
    weights: TrackerReward,
) -> Float[AnyArray, "*batch"]:
    """Pay for one control step of `control_dt` seconds.

    Linear in the error, absolute or relative, so that standing still is never the best answer to a speed; a pull on
    arrival.
    """
    left = after(command, motion).value
    miss = jnp.abs(left)
    is_goal, is_stand, is_jump = (command.slot == slot for slot in (GOAL, STAND, JUMP))
    arrival = weights.arrival * 0.1 / (0.1 + miss)
    if weights.relative:
        slowest, fastest = reach.speed
        wanted = jnp.where(is_goal, jnp.clip(1.5 * left, slowest, fastest), command.value)
        speed = jnp.where(is_goal, motion.displacement / control_dt, motion.pace)
        relative_error = jnp.abs(wanted - speed) / jnp.maximum(jnp.abs(wanted), 0.5)
        moving = weights.relative * jnp.maximum(1 - relative_error, -0.5) + jnp.where(is_goal, arrival, 0.0)
    else:
        goal = arrival - weights.distance * miss
        moving = jnp.where(is_goal, goal, -weights.speed * jnp.abs(command.value - motion.pace))
    stand = arrival - weights.turn * miss
    share = motion.rise / control_dt / jnp.maximum(command.value, LOWEST_JUMP)
    wanted_at_all = jnp.clip(command.value / LOWEST_JUMP, 0.0, 1.0)
    jump = wanted_at_all * jnp.clip(share, 0.0, 1.0) ** 2 - weights.overshoot * jnp.maximum(share - 1.0, 0.0)
    moving = jnp.where(is_jump, jump, moving)
    posture = jnp.where(is_stand, 0.0, weights.upright * (1 - jnp.cos(motion.pitch)))
    posture = posture + weights.energy * jnp.mean(action**2, axis=-1)
    alive = weights.alive * (1.0 - motion.fell)
    return jnp.where(is_stand, stand, moving) - posture + alive
