"""How far and how fast a stick may be moved until a walking policy does not follow, or falls: measured on the robot."""

import math
from collections.abc import Callable
from itertools import product
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.joystick import WAYS, ways_between

SETTLES_S, LASTS_S = 2.0, 4.0
"""Speeds are read from the first on, for as long as the second [s]."""
AT_ONCE = (1.0, 1.5, 2.0, 3.0)
"""Sums of the shares of several ways that are tried."""
REVERSED = 0.1
"""Who moves faster than this against what it is told of a way does not follow all of them at once [m/s, rad/s]."""
TRIES = 3
"""Robots for each combination of ways."""
RATES = (0.5, 1.0, 2.0, 4.0, math.inf)
"""Movements of the stick that are tried [1/s]."""
SHAKEN = 16
"""Robots for each of them."""
SHAKEN_S, JUMP_S = 20.0, 0.5
"""For so long, with a new place of the stick every so often [s]."""


@runtime_checkable  # tests check types as they run
class Follower(Protocol):
    """Robots that follow a joystick."""

    def reset(self, rng: np.random.Generator) -> None:
        """Put them at rest."""
        ...

    def follow(self, command: Float[np.ndarray, "robot 3"]) -> None:
        """A control step under commands [m/s, rad/s]."""
        ...

    def pose(self) -> Float[np.ndarray, "robot 6"]:
        """As `Simulation.pose`."""
        ...

    @property
    def fallen(self) -> Bool[np.ndarray, " robot"]:
        """As `Simulation.fallen`."""
        ...


Followers = Callable[[int], Follower]
"""Makes so many of them."""


def walk(
    batch: Follower, command: Float[np.ndarray, "robot 3"], dt: float
) -> tuple[Float[np.ndarray, "step robot 3"], Bool[np.ndarray, " robot"]]:
    """From rest under commands [m/s, rad/s]: speeds in the heading's frame at each control step of `dt` seconds, and
    who fell.
    """
    batch.reset(np.random.default_rng(0))
    speeds, fell, before = [], np.zeros(len(command), bool), batch.pose()
    for _ in range(round((SETTLES_S + LASTS_S) / dt)):
        batch.follow(command)
        now = batch.pose()
        speeds.append(ways_between(before, now) / dt)
        fell, before = fell | batch.fallen, now
    return np.array(speeds), fell


def ways_at_once(spec: RobotSpec, followers: Followers, drift: Float[np.ndarray, " 3"]) -> float:
    """The largest sum of shares of two and three ways' ends at which nobody falls and no way is reversed; 1 where there
    is none."""
    assert spec.walking is not None
    limits = spec.walking.joystick.limits
    corners = np.array([each for each in product((-1, 0, 1), repeat=len(WAYS)) if np.abs(each).sum() > 1])
    ends = np.where(corners > 0, limits.high, limits.low) * np.abs(corners)
    shares = [np.minimum(1.0, total / np.abs(corners).sum(axis=1, keepdims=True)) for total in AT_ONCE]
    command = np.repeat([share * ends for share in shares], TRIES, axis=1).reshape(-1, len(WAYS))
    speeds, fell = walk(followers(len(command)), command, spec.control_dt)
    gained = (speeds[round(SETTLES_S / spec.control_dt) :].mean(axis=0) - drift) * np.sign(command)
    is_followed = ~fell & (gained > -REVERSED).all(axis=1)
    return _last_good(AT_ONCE, is_followed.reshape(len(AT_ONCE), -1).all(axis=1))


def fastest_stick(spec: RobotSpec, followers: Followers, at_once: float) -> float:
    """The fastest movement of the stick under which no robot falls whose stick jumps [1/s]; the slowest of those that
    are tried where there is none."""
    assert spec.walking is not None
    stick, rng = spec.walking.joystick, np.random.default_rng(0)
    robots = len(RATES) * SHAKEN
    batch = followers(robots)
    batch.reset(rng)
    held, fell = np.zeros((robots, len(WAYS))), np.zeros(robots, bool)
    farthest, wanted = np.repeat(RATES, SHAKEN)[:, None] * spec.control_dt, held
    for step in range(round(SHAKEN_S / spec.control_dt)):
        if step % round(JUMP_S / spec.control_dt) == 0:
            jump = rng.uniform(-1.0, 1.0, (SHAKEN, len(WAYS)))
            jump *= np.minimum(1.0, at_once / np.abs(jump).sum(axis=1, keepdims=True))
            wanted = np.tile(jump, (len(RATES), 1))  # the same for each rate
        held = held + np.clip(wanted - held, -farthest, farthest)
        batch.follow(stick.command(held))
        fell[batch.fallen] = True
    return _last_good(RATES, np.asarray(~fell.reshape(len(RATES), SHAKEN).any(axis=1)))


def _last_good(tried: tuple[float, ...], is_good: np.ndarray) -> float:
    """The last one before the first that is not good, the first where none is."""
    return tried[max(0, int(np.cumprod(is_good).sum()) - 1)]
