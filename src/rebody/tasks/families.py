"""The families of tasks and the reward that is all an agent ever hears of them."""

from dataclasses import dataclass
from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from rebody.errors import RebodyError, did_you_mean
from rebody.tasks.quantities import PITCH, VX, VZ, Quantity, X, wrapped
from rebody.types import AnyArray, GlobalState, Task

RewardForm = Literal["plain", "relative"]
"""plain: -|error|; relative: -|error| / max(|target|, the family's floor)."""
Settle = Literal["last", "mean of 1 s", "largest of 1 s"]
"""What of a quantity is judged at a moment: its value there, or what it was over the second before."""


@dataclass(frozen=True)
class Family:
    """One kind of task: which quantity of the body is to reach the target."""

    name: str
    quantity: Quantity
    floor: float
    """Smallest target magnitude that a relative reward divides by, in the quantity's unit."""
    tolerance: float
    """An episode counts as solved when its final error is within this, in the quantity's unit."""
    settle: Settle
    """How errors are taken: a gait makes velocities uneven, and nobody can hold a jump."""
    asks: str
    """What it asks for, in words."""
    colour: str
    """On the live page, #rrggbb."""

    @property
    def unit(self) -> str:
        """Of its targets."""
        return self.quantity.unit


# Velocities in a global state are means over the last decision, which is what rewards use.
FAMILIES = (
    Family("goal", X, 1.0, 0.25, "last", "reach a position", "#6a4c93"),
    Family("velocity", VX, 0.5, 0.25, "mean of 1 s", "run at a speed", "#3f8f63"),
    Family("stand", PITCH, 0.3, 0.2, "last", "hold a pitch", "#b08900"),
    Family("jump", VZ, 0.5, 0.4, "largest of 1 s", "leave the floor at a speed", "#b5527a"),
)
GOAL, VELOCITY, STAND, JUMP = range(4)


def family_names() -> tuple[str, ...]:
    """Names of all families, in the order of their indices."""
    return tuple(family.name for family in FAMILIES)


def family_index(name: str) -> int:
    """Index of a family in `FAMILIES`; RebodyError if there is none of that name."""
    names = family_names()
    if name in names:
        return names.index(name)
    raise RebodyError(f"unknown task family '{name}'.{did_you_mean(name, names)} Families are: {', '.join(names)}.")


def family_named(name: str) -> Family:
    """The family of that name; RebodyError if there is none."""
    return FAMILIES[family_index(name)]


def base_task(task: Task) -> Int[AnyArray, "*batch"]:
    """Family x sign: the thesis counts front and back as two."""
    return 2 * task.family + (task.target > 0)


def achieved(family: Int[AnyArray, "*batch"], state: GlobalState) -> Float[AnyArray, "*batch"]:
    """The number of each state that its family compares with a target, in the family's unit."""
    of_all = jnp.concatenate([each.quantity.read(state) for each in FAMILIES], axis=-1)
    return jnp.take_along_axis(of_all, family[..., None], axis=-1)[..., 0]


def achieved_by_way_of(family: Int[AnyArray, "*batch"], states: GlobalState) -> Float[AnyArray, "*batch"]:
    """What states in a row, [time, *batch], lead to: the number of the last, or the largest on the way where a family
    is judged by that.
    """
    along = jax.vmap(lambda state: achieved(family, state))(states)
    return jnp.where(_has(family, "largest of 1 s"), along.max(axis=0), along[-1])


def error(task: Task, state: GlobalState) -> Float[AnyArray, "*batch"]:
    """What is achieved minus the target; of an angle the shorter way round."""
    difference = achieved(task.family, state) - task.target
    wraps = jnp.asarray([family.quantity.wraps for family in FAMILIES])[task.family]
    return jnp.where(wraps, wrapped(difference), difference)


def reward(task: Task, state: GlobalState, form: RewardForm) -> Float[AnyArray, "*batch"]:
    """Reward of the decision that led to `state`: never a control cost, never an alive bonus."""
    missed = jnp.abs(error(task, state))
    if form == "plain":
        return -missed
    floors = jnp.asarray([family.floor for family in FAMILIES])
    return -missed / jnp.maximum(jnp.abs(task.target), floors[task.family])


def _has(family: Int[AnyArray, "*batch"], settle: Settle) -> AnyArray:
    return jnp.asarray([each.settle == settle for each in FAMILIES])[family]
