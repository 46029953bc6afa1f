"""How robots moved in a control step."""

import equinox as eqx
import numpy as np
from jaxtyping import Bool, Float

from rebody.bodies.walking.batch import JointBatch
from rebody.bodies.walking.joystick import ways_between
from rebody.types import POSE_FIELDS, AnyArray

CLEARANCE = 0.05
"""Height from which on a foot may move as it likes [m]."""
FASTEST_FOOT = 2.0
"""Nothing is paid for what is faster [m/s]: feet of robots that have just been reset seem to jump."""
HEIGHT, ROLL, PITCH = (POSE_FIELDS.index(name) for name in ("z", "roll", "pitch"))


class Stride(eqx.Module):
    """How a robot moved in a control step."""

    speed: Float[AnyArray, "*batch 3"]  # half of the step's, half of a running mean's [m/s, m/s, rad/s]
    tilt: Float[AnyArray, "*batch"]  # 1 - cos of the angle between the root's up and the world's
    height: Float[AnyArray, "*batch"]  # of the root, as a share of that in the rest pose
    stir: Float[AnyArray, "*batch"]  # mean squared joint velocity [rad^2/s^2]
    drag: Float[AnyArray, "*batch"]  # mean speed of the feet over the ground, less the higher they are [m/s]
    fell: Bool[AnyArray, "*batch"]


def stride_of(
    batch: JointBatch,
    begun: tuple[Float[np.ndarray, "robot 6"], Float[np.ndarray, "robot foot 3"]],
    mean: Float[np.ndarray, "robot 3"],
    smoothing_s: float,
) -> Stride:
    """What the control step did that began in these poses, with the feet there; the running mean of the speeds moves
    on, in place.
    """
    (before, feet), pose, dt = begun, batch.pose(), batch.step_s
    speed = ways_between(before, pose) / dt
    mean += min(1.0, dt / max(smoothing_s, dt)) * (speed - mean)
    numbers = (
        0.5 * (speed + mean),
        1 - np.cos(pose[:, ROLL]) * np.cos(pose[:, PITCH]),
        1 + pose[:, HEIGHT] / batch.spec.torso_height,
        np.mean(batch.joint_velocities**2, axis=-1),
        drag(feet, batch.feet, dt),
    )
    return Stride(*(each.astype(np.float32) for each in numbers), fell=batch.fallen)


def drag(
    before: Float[np.ndarray, "robot foot 3"], now: Float[np.ndarray, "robot foot 3"], dt: float
) -> Float[np.ndarray, " robot"]:
    """How fast feet move over the ground, on average; in full on it, not at all from `CLEARANCE` on [m/s]."""
    if now.shape[1] == 0:
        return np.zeros(len(now))
    speed = np.linalg.norm(now[..., :2] - before[..., :2], axis=-1) / dt
    low = np.clip(1 - 0.5 * (before[..., 2] + now[..., 2]) / CLEARANCE, 0.0, 1.0)
    return np.minimum(low * speed, FASTEST_FOOT).mean(axis=-1)
