"""The step predictor (thesis 6.4.3): how many control steps a subgoal will take from the robot's state."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float, Int

from rebody.control.command import Command
from rebody.control.sac import Actor
from rebody.control.tracker import tracker_observation
from rebody.tasks.family import Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.quantities import length
from rebody.types import AnyArray

MOST_STEPS = 20
"""No subgoal is held for longer [control steps]."""
LOWEST_REWARD, HIGHEST_REWARD = -2.0, 1.0
SMALLEST_SUBGOAL = 0.05
"""Errors are relative to the subgoal, but never to less than this [m, m/s]: at a goal it is nothing."""
STEP_COST = 0.1
"""Paid for every control step."""


def is_predictable(family: Family) -> bool:
    """Whether it knows subgoals of a family: positions and speeds along x, as in the thesis."""
    return family.quantity.components in (("x",), ("vx",))


class StepPredictor(eqx.Module):
    """A policy of one number for one tracker, with that tracker's fixed input scaling."""

    actor: Actor
    families: FamilySet = eqx.field(static=True)

    def __call__(self, joints: Float[AnyArray, "*batch joint"], command: Command) -> Int[AnyArray, "*batch"]:
        """Control steps, from 1 to `MOST_STEPS`, that the command as the robot sees it now will take."""
        return steps_of(self.actor(tracker_observation(joints, command, self.families)))


def steps_of(action: Float[AnyArray, "*batch 1"]) -> Int[AnyArray, "*batch"]:
    """Control steps of an action in [-1, 1]: each number has an equal share of the range."""
    share = 0.5 * (action[..., 0] + 1)
    return jnp.clip(jnp.ceil(MOST_STEPS * share), 1, MOST_STEPS).astype(jnp.int32)


def step_reward(
    command: Command, error: Float[AnyArray, "*batch axis"], steps: Int[AnyArray, "*batch"]
) -> Float[AnyArray, "*batch"]:
    """Pay for holding a command for so many control steps that ended this far from it [m, m/s].

    -|error| / |subgoal| - 0.1 per step, within [-2, 1] (thesis 6.4.3: the negative distance to the subgoal).
    """
    missed = length(error) / jnp.maximum(length(command.value), SMALLEST_SUBGOAL)
    return jnp.clip(-missed - STEP_COST * steps, LOWEST_REWARD, HIGHEST_REWARD)
