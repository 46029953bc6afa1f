"""What all simulations of bodies can do, whatever moves them; joint positions leave it only to be drawn or shown."""

from abc import ABC, abstractmethod

import mujoco
import numpy as np
from jaxtyping import Bool, Float

from rebody.types import DECISION_DT, GlobalState

Who = Bool[np.ndarray, " body"]
"""Which of the bodies are meant."""
Amount = float | Float[np.ndarray, "..."]
"""One of each body that is meant, or the same for all."""
Change = Float[np.ndarray, " body"] | Float[np.ndarray, "body 2"]


class Simulation(ABC):
    """Copies of one body that reset one by one and step together.

    A body that has just been reset or placed counts as having stood still.
    """

    size: int
    actions: int
    """Numbers in the action of one body, each in [-1, 1]."""
    steps_per_decision: int
    root: int
    """Id in the model of the body that a camera follows."""
    joint_actions: Float[np.ndarray, "body joint"]
    """What moved the joints in the last step, as a control cost counts it: the clipped action; of a robot that walks by
    a policy, what the policy said."""

    @property
    def step_s(self) -> float:
        """Seconds of one step."""
        return DECISION_DT / self.steps_per_decision

    @property
    @abstractmethod
    def model(self) -> mujoco.MjModel:
        """What a camera draws."""

    @abstractmethod
    def picture_pose(self) -> Float[np.ndarray, "body nq"]:
        """A copy of the model's joint positions, for a camera [m, rad]."""

    @abstractmethod
    def reset(self, rng: np.random.Generator, who: Who | None = None) -> None:
        """Put these (default: all) at x = 0 in the rest pose, with their reset noise."""

    @abstractmethod
    def place(self, x: Amount, y: Amount | None = None, yaw: Amount | None = None, who: Who | None = None) -> None:
        """Put these (default: all) elsewhere [m], with another heading [rad], as they stand and move.

        None leaves what is; y and yaw are nothing to a body that cannot move so.
        """

    @abstractmethod
    def push(self, change: Change) -> None:
        """Change the speed of each body's every part along x, or along x and y where it can move so [m/s]."""

    @abstractmethod
    def step(self, actions: Float[np.ndarray, "body action"]) -> None:
        """One step of every body; actions are clipped to [-1, 1]. RebodyError if a simulation diverged."""

    @abstractmethod
    def observe(self) -> GlobalState:
        """The body-neutral readout; velocities are displacements over the last 0.1 s."""

    @abstractmethod
    def pose(self) -> Float[np.ndarray, "body 6"]:
        """x, y, z [m], roll, pitch and yaw [rad] now, relative to the rest pose."""

    @abstractmethod
    def joint_state(self) -> Float[np.ndarray, "body joint"]:
        """Positions and velocities of like size, the same wherever a body is."""

    def proprioception(self) -> Float[np.ndarray, "body joint"]:
        """What a tracker sees of each body."""
        return self.joint_state()

    @abstractmethod
    def observation(self) -> Float[np.ndarray, "body observation"]:
        """Joint positions with x, then velocities, as Gymnasium shows them."""

    @property
    @abstractmethod
    def fallen(self) -> Who:
        """Which have lain long enough to count as fallen."""

    @property
    @abstractmethod
    def state(self) -> Float[np.ndarray, "body state"]:
        """A copy of all that they continue from bit-exactly, the last 0.1 s included."""

    @state.setter
    @abstractmethod
    def state(self, value: Float[np.ndarray, "body state"]) -> None: ...
