"""Joystick commands: forward, sideways [m/s] and turn [rad/s] in the heading's frame, as walking policies follow."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from rebody.bodies.attitude import in_heading, wrap_angle
from rebody.ranges import Box
from rebody.types import POSE_FIELDS, GlobalState

YAW = POSE_FIELDS.index("yaw")

WAYS = ("forward", "sideways", "turn")
UNITS = ("m/s", "m/s", "rad/s")
NAVIGATOR_SEES = 16
"""Numbers of `navigator_sees`."""
NAVIGATED_M = 3.0
"""How far ahead a navigator is shown a place [m]."""
REST = 0.05
"""Actions below this are none: the stick is let go."""


def ways_between(
    before: Float[np.ndarray, "robot 6"], now: Float[np.ndarray, "robot 6"]
) -> Float[np.ndarray, "robot 3"]:
    """How far robots got ahead and to the left, and turned, from one pose to the next [m, m, rad]; in the frame of the
    heading before.
    """
    moved = in_heading(now[:, :2] - before[:, :2], before[:, YAW])
    return np.column_stack([moved, wrap_angle(now[:, YAW] - before[:, YAW])])


class Measured(NamedTuple):
    """What is known of a walking policy, forward, sideways [m/s] and turn [rad/s]: [*batch, 3] each, NumPy or JAX."""

    low: Any
    high: Any
    dead: Any
    drift: Any
    at_once: Any  # [*batch, 1]


@dataclass(frozen=True)
class Joystick:
    """What a walking policy follows, as `rebody robot check` measures it."""

    limits: Box
    """Forward, sideways [m/s], turn [rad/s]; both ends 0 for a way that it does not go."""
    dead: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The slowest command of each way that moves the robot."""
    drift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """How it moves while none is given."""
    at_once: float = 3.0
    """How many ways it follows at full at once: the shares of their ends add up to at most this."""
    rate: float = math.inf
    """How fast the stick may move [1/s]: some policies fall when commands jump."""

    @property
    def measured(self) -> Measured:
        """As arrays."""
        parts = (self.limits.low, self.limits.high, self.dead, self.drift, (self.at_once,))
        return Measured(*(np.asarray(each, np.float32) for each in parts))

    def command(self, actions: Any) -> Any:
        """Commands for actions [..., 3] in [-1, 1], of NumPy or JAX: none at rest, else beyond the dead band.

        Slow commands that a policy takes for standing still are stepped over: whoever asks for 0.1 m/s near its goal
        would wait for ever.
        """
        xp = jnp if isinstance(actions, jax.Array) else np
        return joystick_command(actions, self.measured, xp)

    def towards(self, held: Float[np.ndarray, "*batch 3"], wanted: Float[np.ndarray, "*batch 3"], dt: float):
        """Where a stick that is held there may be after `dt` seconds, which is to be there; both in [-1, 1]."""
        return held + np.clip(wanted - held, -self.rate * dt, self.rate * dt)


def joystick_command(actions: Any, robot: Measured, xp: Any) -> Any:
    """`Joystick.command` of arrays."""
    share = (xp.clip(abs(actions), REST, 1.0) - REST) / (1.0 - REST)
    share = share * fitting(share, robot, xp)
    most = xp.where(actions > 0, robot.high, -robot.low)
    size = xp.minimum(robot.dead + share * (most - robot.dead), most)
    return xp.where(abs(actions) > REST, xp.sign(actions) * xp.maximum(size, 0.0), 0.0)


def fitting(shares: Any, robot: Measured, xp: Any) -> Any:
    """What shares of the ways' ends [..., 3] are multiplied by, [..., 1], so that the robot can follow all at once."""
    asked = xp.where(robot.high > robot.low, shares, 0.0).sum(axis=-1, keepdims=True)
    return xp.minimum(1.0, robot.at_once / xp.maximum(asked, 1e-6))


def navigator_sees(state: GlobalState, robot: Measured, xp: Any) -> Any:
    """What a navigator knows of a body, [*batch, 16]: how it moved over the last 0.1 s in the frame of its heading
    [m/s, rad/s], then what was measured of it.
    """
    cos, sin = xp.cos(state.yaw), xp.sin(state.yaw)
    ahead, left = cos * state.vx + sin * state.vy, cos * state.vy - sin * state.vx
    moves = xp.stack([ahead, left, state.yaw_rate], axis=-1)
    shape = moves.shape[:-1]
    return xp.concatenate([moves, *(xp.broadcast_to(each, (*shape, each.shape[-1])) for each in robot)], axis=-1)
