"""Robots that walk by a policy which is being learned."""

import equinox as eqx
import numpy as np
from jaxtyping import Float

from rebody.bodies import RobotSpec
from rebody.bodies.walking.batch import JointBatch
from rebody.control.sac import Actor
from rebody.training.walking.scales import input_scales
from rebody.types import AnyArray


class ActorFollower(JointBatch):
    """They do what is most likely right."""

    def __init__(self, spec: RobotSpec, size: int, actor: Actor):
        super().__init__(spec, size)
        self._actor, self._scales = actor, input_scales(self.joints)

    def follow(self, command: Float[np.ndarray, "robot 3"]) -> None:
        """A control step under joystick commands [m/s, rad/s]."""
        self.step(np.asarray(_best(self._actor, self.hear(command) * self._scales)))


@eqx.filter_jit
def _best(actor: Actor, observation: Float[AnyArray, "robot number"]):
    return actor(observation)
