"""What moves a robot's joints at every control step."""

import math
from abc import abstractmethod

import equinox as eqx
import numpy as np
from jaxtyping import Float

from rebody.bodies import Simulation
from rebody.control.command import addressed, relative, slots_among, within_sight
from rebody.control.flat import FlatPolicy
from rebody.control.tracker import Tracker
from rebody.inference.decoder import Decoder
from rebody.tasks import FamilySet
from rebody.types import AnyArray, Belief, Pose, Subgoal


class Controller(eqx.Module):
    """(what it sees of the body, pose, subgoal, belief) -> joint action; each kind looks at what it needs."""

    @abstractmethod
    def see(self, body: Simulation) -> Float[np.ndarray, "robot joint"]:
        """What it sees of each robot's body."""

    @abstractmethod
    def __call__(
        self, joints: Float[AnyArray, "*batch joint"], pose: Pose, subgoal: Subgoal, belief: Belief | None
    ) -> Float[AnyArray, "*batch action"]:
        """Joint action in [-1, 1]."""


class TrackerController(Controller):
    """Follows the subgoal."""

    tracker: Tracker
    slots: tuple[int, ...] = eqx.field(static=True)
    """Of each family in play, its slot in the tracker; -1 for none."""
    goal_ahead: float = eqx.field(static=True)
    """Farthest that a place is shown ahead [m], see `RobotSpec.goal_ahead`."""

    def __init__(self, tracker: Tracker, families: FamilySet | None = None, goal_ahead: float = math.inf):
        """Subgoals are about `families`; by default the tracker's own."""
        self.tracker, self.goal_ahead = tracker, goal_ahead
        self.slots = slots_among(families or tracker.families, tracker.families)

    def see(self, body):
        """The joint state, and the filtered speed where there is one."""
        return body.proprioception()

    def __call__(self, joints, pose, subgoal, belief):
        """A place is made relative to where the robot is now."""
        families = self.tracker.families
        command = relative(families, addressed(subgoal, self.slots), pose)
        if not math.isinf(self.goal_ahead):
            command = within_sight(families, command, self.goal_ahead)
        return self.tracker(joints, command)


class FlatController(Controller):
    """Follows the belief itself (thesis 6.3.2)."""

    policy: FlatPolicy
    decoder: Decoder

    def see(self, body):
        """The joint state."""
        return body.joint_state()

    def __call__(self, joints, pose, subgoal, belief):
        """There is no subgoal."""
        assert belief is not None
        return self.policy(joints, pose, self.decoder.interpret(belief))
