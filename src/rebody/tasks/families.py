"""The families of tasks and the reward that is all an agent ever hears of them."""

import difflib
from dataclasses import dataclass
from typing import Literal

import jax
import jax.numpy as jnp
from jaxtyping import Float, Int

from rebody.errors import RebodyError
from rebody.types import AnyArray, GlobalState, Task

RewardForm = Literal["plain", "relative"]
"""plain: -|error|; relative: -|error| / max(|target|, the family's floor)."""


@dataclass(frozen=True)
class Family:
    """One kind of task: which number of the body is to reach the target."""

    name: str
    unit: str
    floor: float
    """Smallest target magnitude that a relative reward divides by, in the family's unit."""
    tolerance: float
    """An episode counts as solved when its final error is within this, in the family's unit."""
    field: str
    """The field of the global state that is compared with the target."""


# Velocities in a global state are means over the last decision, which is what rewards use.
FAMILIES = (
    Family("goal", "m", floor=1.0, tolerance=0.25, field="x"),
    Family("velocity", "m/s", floor=0.5, tolerance=0.25, field="vx"),
    Family("stand", "rad", floor=0.3, tolerance=0.2, field="pitch"),
    Family("jump", "m/s", floor=0.5, tolerance=0.4, field="vz"),
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
    near = difflib.get_close_matches(name, names, n=1)
    hint = f"; did you mean '{near[0]}'?" if near else ""
    raise RebodyError(f"unknown task family '{name}'{hint} Families are: {', '.join(names)}.")


def base_task(task: Task) -> Int[AnyArray, "*batch"]:
    """Family x sign: the thesis counts front and back as two."""
    return 2 * task.family + (task.target > 0)


def achieved(family: Int[AnyArray, "*batch"], state: GlobalState) -> Float[AnyArray, "*batch"]:
    """The number of each state that its family compares with a target, in the family's unit."""
    of_all = state.select(tuple(each.field for each in FAMILIES))
    return jnp.take_along_axis(of_all, family[..., None], axis=-1)[..., 0]


def achieved_by_way_of(family: Int[AnyArray, "*batch"], states: GlobalState) -> Float[AnyArray, "*batch"]:
    """What states in a row, [time, *batch], lead to: the number of the last, of a jump the fastest rise on the way."""
    last = achieved(family, jax.tree.map(lambda leaf: leaf[-1], states))
    return jnp.where(family == JUMP, states.vz.max(axis=0), last)


def reward(task: Task, state: GlobalState, form: RewardForm) -> Float[AnyArray, "*batch"]:
    """Reward of the decision that led to `state`: never a control cost, never an alive bonus."""
    error = jnp.abs(achieved(task.family, state) - task.target)
    if form == "plain":
        return -error
    floors = jnp.asarray([family.floor for family in FAMILIES])
    return -error / jnp.maximum(jnp.abs(task.target), floors[task.family])
