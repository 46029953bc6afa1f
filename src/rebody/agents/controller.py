"""What moves a robot's joints at every control step."""

from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Float

from rebody.control.flat import FlatPolicy
from rebody.control.tracker import Command, Tracker
from rebody.tasks import GOAL
from rebody.types import AnyArray, Belief, Subgoal


class Controller(eqx.Module):
    """(joint state, x, subgoal, belief) -> joint action; each kind looks at what it needs."""

    @abstractmethod
    def __call__(
        self,
        joints: Float[AnyArray, "*batch joint"],
        x: Float[AnyArray, "*batch"],
        subgoal: Subgoal,
        belief: Belief | None,
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""


class TrackerController(Controller):
    """Follows the subgoal."""

    tracker: Tracker

    def __call__(self, joints, x, subgoal, belief):
        """A goal is made relative to where the robot is now."""
        return self.tracker(joints, Command(subgoal.slot, relative(subgoal, x)))


class FlatController(Controller):
    """Follows the belief itself (thesis 6.3.2)."""

    policy: FlatPolicy

    def __call__(self, joints, x, subgoal, belief):
        """There is no subgoal."""
        assert belief is not None
        return self.policy(joints, x, belief)


def relative(subgoal: Subgoal, x: Float[AnyArray, "*batch"]) -> Float[AnyArray, "*batch"]:
    """A subgoal as the robot sees it now: a goal is a point in the world, so its distance shrinks."""
    return subgoal.value - jnp.where(subgoal.slot == GOAL, x, 0.0)
