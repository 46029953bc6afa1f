"""What a walking policy makes of commands."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies import RobotSpec
from rebody.bodies.walking.joystick import WAYS, ways_between
from rebody.bodies.walking.stick import SETTLES_S
from rebody.control.sac import Actor
from rebody.ranges import Box
from rebody.training.walking.follower import ActorFollower

SLOW = (0.1, 0.3)
"""Slow commands [m/s]."""
PUSH, PUSH_EVERY_S = 0.5, 3.0
"""Of the stress: largest push each way [m/s], how often [s]."""


class Walk(NamedTuple):
    """What robots did."""

    speed: Float[np.ndarray, "robot 3"]  # mean after it has settled, in the heading's frame [m/s, m/s, rad/s]
    moved: Float[np.ndarray, " robot"]  # distance from where it began [m]
    fell: Bool[np.ndarray, " robot"]


def walk(
    batch: ActorFollower,
    command: Float[np.ndarray, "robot 3"],
    seconds: float,
    each_step: Callable[[int, np.ndarray], None] = lambda step, command: None,
) -> Walk:
    """Robots from rest under commands [m/s, rad/s], which `each_step` may change."""
    batch.reset(np.random.default_rng(0))
    begun = before = batch.pose()
    total, fell, settles = np.zeros((batch.size, 3)), np.zeros(batch.size, bool), round(SETTLES_S / batch.step_s)
    steps = max(settles + 1, round(seconds / batch.step_s))
    for step in range(steps):
        each_step(step, command)
        batch.follow(command)
        now = batch.pose()
        if step >= settles:
            total += ways_between(before, now)
        before, fell = now, fell | batch.fallen
    away = np.linalg.norm(now[:, :2] - begun[:, :2], axis=-1)
    return Walk(total / ((steps - settles) * batch.step_s), away, fell)


def held_out(limits: Box, size: int, seed: int = 2**31 - 1) -> Float[np.ndarray, "command 3"]:
    """Commands over the whole range, all three ways at once."""
    return np.random.default_rng(seed).uniform(limits.low, limits.high, (size, len(WAYS)))


def measure(batch: ActorFollower, limits: Box, seconds: float) -> dict[str, float]:
    """Errors of held-out commands, share that fell."""
    command = held_out(limits, batch.size)
    walked = walk(batch, command, seconds)
    missed = np.abs(walked.speed - command)
    figures = {"fell": float(walked.fell.mean())}
    for i, way in enumerate(WAYS):
        figures |= {
            f"{way} median": float(np.median(missed[:, i])),
            f"{way} p95": float(np.quantile(missed[:, i], 0.95)),
        }
    return figures


def slow_error(spec: RobotSpec, actor: Actor, size: int, seconds: float) -> float:
    """Median error of the speed under slow commands in any direction over the ground [m/s]."""
    rng = np.random.default_rng(0)
    speed, bearing = rng.uniform(*SLOW, size), rng.uniform(-np.pi, np.pi, size)
    command = np.column_stack([speed * np.cos(bearing), speed * np.sin(bearing), np.zeros(size)])
    walked = walk(ActorFollower(spec, size, actor), command, seconds)
    return float(np.median(np.linalg.norm((walked.speed - command)[:, :2], axis=-1)))


def stand(spec: RobotSpec, actor: Actor, size: int, seconds: float) -> float:
    """How far robots that are told nothing get, median [m]."""
    return float(np.median(walk(ActorFollower(spec, size, actor), np.zeros((size, len(WAYS))), seconds).moved))


def stressed(spec: RobotSpec, actor: Actor, limits: Box, size: int, seconds: float) -> float:
    """Share that falls under pushes and commands that change."""
    batch, rng = ActorFollower(spec, size, actor), np.random.default_rng(1)
    every = round(PUSH_EVERY_S / batch.step_s)

    def disturb(step: int, command: np.ndarray) -> None:
        if step % every == every - 1:
            batch.push(rng.uniform(-PUSH, PUSH, (batch.size, 2)))
            command[:] = rng.uniform(limits.low, limits.high, command.shape)

    return float(walk(batch, held_out(limits, size), seconds, disturb).fell.mean())
