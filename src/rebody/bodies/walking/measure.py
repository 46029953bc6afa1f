"""What a walking policy makes of commands: reached speeds, dead band, lag, drift and falls, measured on the robot."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.attitude import in_heading, wrap_angle
from rebody.bodies.robot import RobotSpec
from rebody.bodies.walking.batch import WalkingBatch
from rebody.bodies.walking.joystick import WAYS

SHARES = tuple(np.linspace(0.05, 1.0, 20).tolist())
"""Of a way's limits, both ends."""
SETTLES_S, LASTS_S = 2.0, 4.0
"""What is read begins after the first, and lasts as long as the second [s]."""
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

    @property
    def dead(self) -> tuple[float, ...]:
        """Dead band of each way."""
        return tuple(way.dead(drift) for way, drift in zip(self.ways, self.drift, strict=True))

    @property
    def falls(self) -> int:
        """How many of the robots fell."""
        return sum(int(way.fell.sum()) for way in self.ways)


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


def measure_walking(spec: RobotSpec, followers: Callable[[int], Follower] | None = None) -> WalkingMeasured:
    """A robot for each command of each way, all from rest, for 6 s; RebodyError where one diverges.

    `followers` makes so many of them, where they do not walk by the policy of their description.
    """
    assert spec.walking is not None
    limits, commands = spec.walking.joystick.limits, [np.zeros(len(WAYS))]
    for way in range(len(WAYS)):
        for end in (limits.low[way], limits.high[way]):
            commands += [share * end * np.eye(len(WAYS))[way] for share in SHARES if end]
    command = np.array(commands)
    batch = WalkingBatch(spec, len(command)) if followers is None else followers(len(command))
    speeds, fell = _walk(batch, command, spec.control_dt)
    settled = speeds[round(SETTLES_S / spec.control_dt) :].mean(axis=0)
    ahead = int(np.argmax(command[:, 0]))
    window = max(1, round(GAIT_S / spec.control_dt))
    reached = np.convolve(speeds[:, ahead, 0], np.full(window, 1 / window), "same")
    lag = np.argmax(reached >= 0.63 * settled[ahead, 0]) * spec.control_dt
    return WalkingMeasured(tuple(_way(i, command, settled, fell) for i in range(len(WAYS))), settled[0], float(lag))


def _walk(batch: Follower, command: Float[np.ndarray, "robot 3"], dt: float):
    """Speeds in the frame of the heading at each control step of `dt` seconds [m/s, rad/s], and who fell."""
    batch.reset(np.random.default_rng(0))
    speeds, fell, before = [], np.zeros(len(command), bool), batch.pose()
    for _ in range(round((SETTLES_S + LASTS_S) / dt)):
        batch.follow(command)
        now = batch.pose()
        moved = in_heading(now[:, :2] - before[:, :2], before[:, 5])
        speeds.append(np.column_stack([moved, wrap_angle(now[:, 5] - before[:, 5])]) / dt)
        fell, before = fell | batch.fallen, now
    return np.array(speeds), fell


def _way(i: int, command: np.ndarray, settled: np.ndarray, fell: np.ndarray) -> WayMeasured:
    own = np.flatnonzero((command[:, i] != 0) | ~command.any(axis=1))
    own = own[np.argsort(command[own, i])]
    return WayMeasured(WAYS[i], command[own, i], settled[own, i], fell[own])
