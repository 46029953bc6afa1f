"""What moves a robot's joints at every control step."""

import math
from abc import abstractmethod

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.bodies import Simulation
from rebody.control.flat import FlatPolicy
from rebody.control.tracker import Command, Tracker, relative
from rebody.inference.decoder import Decoder
from rebody.tasks import GOAL
from rebody.types import AnyArray, Belief, Subgoal


class Controller(eqx.Module):
    """(what it sees of the body, x, pitch, subgoal, belief) -> joint action; each kind looks at what it needs."""

    @abstractmethod
    def see(self, body: Simulation) -> Float[np.ndarray, "robot joint"]:
        """What it sees of each robot's body."""

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
    goal_ahead: float = eqx.field(static=True, default=math.inf)
    """Farthest that a goal is shown ahead [m], see `RobotSpec.goal_ahead`."""

    def see(self, body):
        """The joint state, and the pace where there is one."""
        return body.proprioception()

    def __call__(self, joints, x, pitch, subgoal, belief):
        """A goal is made relative to where the robot is now."""
        command = relative(subgoal, x, pitch)
        near = jnp.clip(command.value, -self.goal_ahead, self.goal_ahead)
        return self.tracker(joints, Command(command.slot, jnp.where(command.slot == GOAL, near, command.value)))


class FlatController(Controller):
    """Follows the belief itself (thesis 6.3.2)."""

    policy: FlatPolicy
    decoder: Decoder

    def see(self, body):
        """The joint state."""
        return body.joint_state()

    def __call__(self, joints, x, pitch, subgoal, belief):
        """There is no subgoal."""
        assert belief is not None
        return self.policy(joints, x, self.decoder.interpret(belief))
