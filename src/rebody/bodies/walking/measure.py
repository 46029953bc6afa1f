"""What a walking policy makes of commands: reached speeds, dead band, lag, drift and falls, measured on the robot."""

from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.batch import WalkingBatch
from rebody.bodies.walking.joystick import WAYS
from rebody.bodies.walking.stick import SETTLES_S, Followers, fastest_stick, walk, ways_at_once

SHARES = tuple(np.linspace(0.05, 1.0, 20).tolist())
"""Of a way's limits, both ends."""
GAIT_S = 0.3
"""A step or two, whose mean tells the speed [s]."""
STANDS = 0.02
"""What is slower than this stands still [m/s, rad/s]."""
FOLLOWED = 0.5
"""Share of a command that must be reached for it not to be in the dead band."""


@dataclass(frozen=True)
class WayMeasured:
    """One way of the joystick, its commands from the lowest to the highest, [command] each."""

    way: str
    commanded: Float[np.ndarray, " command"]
    reached: Float[np.ndarray, " command"]
    """Mean along the same way [m/s, rad/s]."""
    fell: Bool[np.ndarray, " command"]

    def dead(self, drift: float) -> float:
        """The slowest command that is followed; 0 where none leaves the robot standing."""
        size, gained = np.abs(self.commanded), (self.reached - drift) * np.sign(self.commanded)
        is_ignored = (gained < FOLLOWED * size) & (size > 0)
        if not is_ignored.any() or not (np.abs(gained[is_ignored]) < STANDS).any():
            return 0.0  # it follows slow ones, be it by less
        return float(size[~is_ignored & (size > 0)].min(initial=np.inf))


@dataclass(frozen=True)
class WalkingMeasured:
    """All that was measured of a robot."""

    ways: tuple[WayMeasured, ...]
    drift: Float[np.ndarray, " 3"]
    """How it moves while no command is given [m/s, rad/s]."""
    lag_s: float
    """Until 63 % of the fastest command ahead is reached."""
    at_once: float
    """The largest sum of shares of several ways' ends that is followed."""
    rate: float
    """The fastest movement of the stick that it takes [1/s]."""

    @property
    def dead(self) -> tuple[float, ...]:
        """Dead band of each way."""
        return tuple(way.dead(drift) for way, drift in zip(self.ways, self.drift, strict=True))

    @property
    def falls(self) -> int:
        """How many of the robots fell."""
        return sum(int(way.fell.sum()) for way in self.ways)


def measure_walking(spec: RobotSpec, followers: Followers | None = None) -> WalkingMeasured:
    """A robot for each command of each way, all from rest, for 6 s; RebodyError where one diverges.

    `followers` makes so many of them, where they do not walk by the policy of their description.
    """
    followers = followers or partial(WalkingBatch, spec)
    assert spec.walking is not None
    limits, commands = spec.walking.joystick.limits, [np.zeros(len(WAYS))]
    for way in range(len(WAYS)):
        for end in (limits.low[way], limits.high[way]):
            commands += [share * end * np.eye(len(WAYS))[way] for share in SHARES if end]
    command = np.array(commands)
    speeds, fell = walk(followers(len(command)), command, spec.control_dt)
    settled = speeds[round(SETTLES_S / spec.control_dt) :].mean(axis=0)
    ahead = int(np.argmax(command[:, 0]))
    window = max(1, round(GAIT_S / spec.control_dt))
    reached = np.convolve(speeds[:, ahead, 0], np.full(window, 1 / window), "same")
    lag = np.argmax(reached >= 0.63 * settled[ahead, 0]) * spec.control_dt
    drift, at_once = settled[0], ways_at_once(spec, followers, settled[0])
    ways = tuple(_way(i, command, settled, fell) for i in range(len(WAYS)))
    return WalkingMeasured(ways, drift, float(lag), at_once, fastest_stick(spec, followers, at_once))


def _way(i: int, command: np.ndarray, settled: np.ndarray, fell: np.ndarray) -> WayMeasured:
    own = np.flatnonzero((command[:, i] != 0) | ~command.any(axis=1))
    own = own[np.argsort(command[own, i])]
    return WayMeasured(WAYS[i], command[own, i], settled[own, i], fell[own])
