"""The tracker ("transfer function" in the thesis, 5.5): (joint state, command) -> joint action.

One network serves all slots (5.6): the families of what it can be commanded to do, each with the range that it was
trained for as its targets.
"""

from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.control.command import Command, Motion, after, of_rates, per_slot
from rebody.control.sac import Actor
from rebody.ranges import NotNegative
from rebody.tasks.family import Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.quantities import length
from rebody.types import ANGLES, POSE_FIELDS, RATE_OF, AnyArray

MARGIN = 1.1
"""Trackers are trained on commands that go beyond a robot's reach by this factor, and cut farther ones to it."""
SLOWEST = 0.5
"""Slowest jump that is paid in full, and least speed that errors are relative to [m/s]."""
ROLL, PITCH = POSE_FIELDS.index("roll"), POSE_FIELDS.index("pitch")


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
    families: FamilySet = eqx.field(static=True)
    """What a command can ask for, and how much of it."""

    @property
    def joints(self) -> int:
        """Size of the joint state that it sees."""
        return self.actor.observations - command_inputs(self.families)

    def __call__(self, joints: Float[AnyArray, "*batch joint"], command: Command) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""
        return self.actor(tracker_observation(joints, command, self.families))


def command_inputs(families: FamilySet) -> int:
    """How many numbers of a tracker's observation are its command."""
    nothing = Command(np.zeros((), np.int32), np.zeros(families.size, np.float32))
    return jax.eval_shape(lambda: tracker_observation(jnp.zeros(0), nothing, families)).size


def tracker_observation(
    joints: Float[AnyArray, "*batch joint"], command: Command, families: FamilySet
) -> Float[AnyArray, "*batch feature"]:
    """Joint state and command, what is to be reached on three scales so that centimetres count as metres do."""
    is_slot = [jnp.asarray(command.slot == i, joints.dtype) for i in range(len(families))]
    features = [*is_slot]
    for here, family in zip(is_slot, families, strict=True):
        for i, name in enumerate(family.quantity.components):
            features += _seen(name, here, command.value[..., i], family.range.low[i], family.range.high[i])
    return jnp.concatenate([joints, jnp.stack(features, axis=-1)], axis=-1)


def _seen(component: str, is_slot, value, low: float, high: float) -> list[Float[AnyArray, "*batch"]]:
    """One number of a command, 0 in all slots but its own."""
    if component in RATE_OF:
        return [is_slot * jnp.clip(value, min(0.0, MARGIN * low), max(0.0, MARGIN * high))]
    far = 1.0 if component in ANGLES else MARGIN * max(abs(low), abs(high))
    left = is_slot * (value if component in ANGLES else jnp.clip(value, -far, far))
    return [left / far, jnp.tanh(2 * left), jnp.tanh(10 * left)]


def tracker_reward(
    command: Command,
    motion: Motion,
    control_dt: float,
    action: Float[AnyArray, "*batch action"],
    families: FamilySet,
    weights: TrackerReward,
) -> Float[AnyArray, "*batch"]:
    """Pay for one control step of `control_dt` seconds.

    Linear in the error, absolute or relative, so that standing still is never the best answer to a speed; a pull on
    arrival.
    """
    left = after(families, command, motion).value
    tilt = 1 - jnp.cos(motion.pose[..., ROLL]) * jnp.cos(motion.pose[..., PITCH])
    paid = []
    for family in families:
        own, asked = left[..., : family.size], command.value[..., : family.size]
        posture = 0.0 if _asks_for_attitude(family) else weights.upright * tilt
        paid.append(_pay(family, families, asked, own, motion, control_dt, weights) - posture)
    energy = weights.energy * jnp.mean(action**2, axis=-1)
    return per_slot(paid, command.slot) - energy + weights.alive * (1.0 - motion.fell)


def _pay(family: Family, families: FamilySet, asked, left, motion: Motion, control_dt: float, weights: TrackerReward):
    """What the slot itself is worth."""
    speed = of_rates(family, motion.displacement) / control_dt
    if family.settle == "largest of 1 s":
        return _pay_jump(asked, speed, weights)
    if not family.is_pose:
        return _pay_speed(asked, of_rates(family, motion.velocity), weights)
    arrival = weights.arrival * 0.1 / (0.1 + length(left))
    if weights.relative and not any(family.quantity.wraps):
        slowest, fastest = _speeds(family, families)
        return _pay_speed(jnp.clip(1.5 * left, slowest, fastest), speed, weights) + arrival
    price = np.array([weights.turn if wraps else weights.distance for wraps in family.quantity.wraps], np.float32)
    return arrival - length(price * left)


def _pay_speed(wanted, speed, weights: TrackerReward):
    miss = length(wanted - speed)
    if not weights.relative:
        return -weights.speed * miss
    return weights.relative * jnp.maximum(1 - miss / jnp.maximum(length(wanted), SLOWEST), -0.5)


def _pay_jump(asked, speed, weights: TrackerReward):
    """By the share of the speed asked for, along its direction."""
    size = length(asked)
    along = speed[..., 0] if asked.shape[-1] == 1 else jnp.sum(speed * asked, axis=-1) / jnp.maximum(size, 1e-6)
    share = along / jnp.maximum(size, SLOWEST)
    wanted_at_all = jnp.clip(size / SLOWEST, 0.0, 1.0)
    return wanted_at_all * jnp.clip(share, 0.0, 1.0) ** 2 - weights.overshoot * jnp.maximum(share - 1.0, 0.0)


def _speeds(family: Family, families: FamilySet) -> tuple[np.ndarray, np.ndarray]:
    """Between which speeds the robot moves along a place's components; any where no slot says so."""
    low, high = np.full(family.size, -np.inf, np.float32), np.full(family.size, np.inf, np.float32)
    for other in families:
        for i, component in enumerate(other.quantity.components):
            if RATE_OF.get(component) in family.quantity.components and other.settle != "largest of 1 s":
                place = family.quantity.components.index(RATE_OF[component])
                low[place], high[place] = other.range.low[i], other.range.high[i]
    return low, high


def _asks_for_attitude(family: Family) -> bool:
    return bool({"pitch", "roll"} & set(family.quantity.components))
