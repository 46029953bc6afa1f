"""What moves a robot's joints at every control step."""

from abc import abstractmethod

import equinox as eqx
from jaxtyping import Float

from rebody.control.flat import FlatPolicy
from rebody.control.tracker import Tracker, relative
from rebody.types import AnyArray, Belief, Subgoal


class Controller(eqx.Module):
    """(joint state, x, pitch, subgoal, belief) -> joint action; each kind looks at what it needs."""

    @abstractmethod
    def __call__(
        self,
        joints: Float[AnyArray, "*batch joint"],
        x: Float[AnyArray, "*batch"],
        pitch: Float[AnyArray, "*batch"],
        subgoal: Subgoal,
        belief: Belief | None,
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""


class TrackerController(Controller):
    """Follows the subgoal."""

    tracker: Tracker

    def __call__(self, joints, x, pitch, subgoal, belief):
        """A goal is made relative to where the robot is now."""
        return self.tracker(joints, relative(subgoal, x, pitch))


class FlatController(Controller):
    """Follows the belief itself (thesis 6.3.2)."""

    policy: FlatPolicy

    def __call__(self, joints, x, pitch, subgoal, belief):
        """There is no subgoal."""
        assert belief is not None
        return self.policy(joints, x, belief)
