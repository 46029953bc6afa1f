"""Commands: subgoals as a robot sees them, and what they become when it moves."""

from collections.abc import Sequence
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from rebody.bodies.robot import Reach
from rebody.tasks.family import Family
from rebody.tasks.family_set import FamilySet, fit
from rebody.tasks.quantities import length, turned, wrapped_where
from rebody.types import POSE_FIELDS, RATE_OF, AnyArray, Pose, Subgoal

YAW = POSE_FIELDS.index("yaw")
HORIZONTAL = (("x", "y"), ("vx", "vy"))
"""Components that turn with the heading."""


class Command(eqx.Module):
    """A subgoal from where the robot is: what is to be moved or turned by, in the heading's frame, or a speed."""

    slot: Int[AnyArray, "*batch"]  # index into the tracker's families
    value: Float[AnyArray, "*batch axis"]  # in the units of its quantity, zeros behind its size


class Motion(eqx.Module):
    """What a control step did to the robot; `POSE_FIELDS` on the last axis [m, rad, m/s, rad/s]."""

    displacement: Float[AnyArray, "*batch 6"]  # in the frame of the heading before, turns the shorter way round
    pose: Pose  # afterwards
    velocity: Float[AnyArray, "*batch 6"]  # in the same frame: that of this step, or a mean over the last ones
    fell: Bool[AnyArray, "*batch"]


def commands_within(reach: Reach, families: FamilySet) -> FamilySet:
    """What a robot can be commanded to do, its reach as the targets; RebodyError for a family that is not known."""
    return FamilySet(tuple(families.named(name).within(box) for name, box in reach))


def slots_among(families: FamilySet, commands: FamilySet) -> tuple[int, ...]:
    """Of each of the families that are in play, its slot among a tracker's; -1 for none."""
    return tuple(commands.index(name) if name in commands else -1 for name in families.names)


def addressed(subgoal: Subgoal, slots: tuple[int, ...]) -> Subgoal:
    """A subgoal under a tracker's own indices, see `slots_among`."""
    return Subgoal(jnp.asarray(slots)[subgoal.slot], subgoal.value)


def relative(families: FamilySet, subgoal: Subgoal, pose: Pose) -> Command:
    """A subgoal as a robot in this pose sees it now: a place is a point in the world, so its distance shrinks."""
    value = fit(subgoal.value, families.size)
    left = _apart(families, subgoal.slot, value, _moved(families, subgoal.slot, pose))
    return Command(subgoal.slot, _turned(families, subgoal.slot, left, -pose[..., YAW]))


def absolute(families: FamilySet, command: Command, pose: Pose) -> Subgoal:
    """The subgoal that a robot in this pose sees so."""
    value = _turned(families, command.slot, command.value, pose[..., YAW])
    return Subgoal(command.slot, value + _moved(families, command.slot, pose))


def within_sight(families: FamilySet, command: Command, ahead: float | Float[AnyArray, "*batch"]) -> Command:
    """The same, but places no farther ahead than that [m]: farther ones are shown in their direction."""
    is_place = jnp.asarray([each.is_pose and not any(each.quantity.wraps) for each in families])[command.slot]
    distance = length(command.value)
    is_far = (is_place & (distance > ahead))[..., None]
    direction = command.value / jnp.maximum(distance, 1e-9)[..., None]  # an exact sign where there is one axis
    nearer = direction * jnp.asarray(ahead)[..., None]
    return Command(command.slot, jnp.where(is_far, nearer, command.value))


def after(families: FamilySet, command: Command, motion: Motion) -> Command:
    """The same subgoal as it is seen after a motion."""
    left = _apart(families, command.slot, command.value, _moved(families, command.slot, motion.displacement))
    return Command(command.slot, _turned(families, command.slot, left, -motion.displacement[..., YAW]))


def of_pose(family: Family, pose: Pose) -> Float[AnyArray, "*batch size"]:
    """What a family's quantity reads in a pose; 0 for speeds."""
    return stacked(
        [pose[..., POSE_FIELDS.index(c)] if c in POSE_FIELDS else 0 * pose[..., 0] for c in family.quantity.components]
    )


def of_rates(family: Family, velocity: Float[AnyArray, "*batch 6"]) -> Float[AnyArray, "*batch size"]:
    """The components of a velocity that its quantity is about, or is moved by."""
    return stacked([velocity[..., POSE_FIELDS.index(RATE_OF.get(c, c))] for c in family.quantity.components])


def per_slot(of_each: Sequence[Any], slot: Int[AnyArray, "*batch"]) -> Any:
    """Of numbers [*batch, ...] for each family, those of the slot."""
    xp = _library(of_each[0])
    chosen = of_each[0]
    for i, other in enumerate(of_each[1:], start=1):
        is_slot = slot == i
        chosen = xp.where(is_slot.reshape(is_slot.shape + (1,) * (other.ndim - is_slot.ndim)), other, chosen)
    return chosen


def stacked(columns: Sequence[Any]) -> Any:
    """On a last axis; of NumPy where they are."""
    return _library(columns[0]).stack(columns, axis=-1)


def _moved(families: FamilySet, slot: Int[AnyArray, "*batch"], pose: Pose) -> Float[AnyArray, "*batch axis"]:
    """What of a pose, or of its change, a slot's quantity is about: places and angles, else 0."""
    return per_slot([families.pad(of_pose(family, pose)) for family in families], slot)


def _apart(families: FamilySet, slot: Int[AnyArray, "*batch"], value: Any, here: Any) -> Any:
    """The difference as each slot's quantity has it."""
    if not any(any(family.quantity.wraps) for family in families):
        return value - here
    size = families.size
    wraps = [(*family.quantity.wraps, *(False,) * (size - family.size)) for family in families]
    return per_slot([wrapped_where(each, value - here) for each in wraps], slot)


def _turned(families: FamilySet, slot: Int[AnyArray, "*batch"], value: Any, angle: Any) -> Any:
    """Horizontal vectors turned by an angle; what has no heading stays as it is to the last bit."""
    if not any(_pairs(family) for family in families):
        return value
    of_each = []
    for family in families:
        columns = [value[..., i] for i in range(families.size)]
        for i, j in _pairs(family):
            columns[i], columns[j] = turned(columns[i], columns[j], angle, _library(value))
        of_each.append(stacked(columns))
    return per_slot(of_each, slot)


def _pairs(family: Family) -> list[tuple[int, int]]:
    """Where horizontal vectors of the world stand among a family's components."""
    names = family.quantity.components
    if family.quantity.frame != "world":
        return []
    return [(names.index(x), names.index(y)) for x, y in HORIZONTAL if x in names and y in names]


def _library(array: Any) -> Any:
    return jnp if isinstance(array, jax.Array) else np
