"""What a walking policy is paid for a control step."""

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Float

from rebody.bodies.walking.joints import NO_COMMAND
from rebody.ranges import NotNegative, Positive, Share
from rebody.training.walking.stride import Stride
from rebody.types import AnyArray


@dataclass(frozen=True)
class WalkingReward:
    """Weights of what a walking policy is paid."""

    relative: NotNegative = 0.6
    """Paid in full at the wanted speed, less by the error relative to it: what makes a robot set out."""
    slowest: Positive = 0.2
    """Least speed that errors are relative to [m/s]: larger, slow commands are left to standing still."""
    speed: NotNegative = 0.4
    """Paid in full at the wanted speed, less by a Gaussian of the error: what makes it precise."""
    speed_width: Positive = 0.17
    """Standard deviation of that Gaussian [m/s]."""
    turn: NotNegative = 0.4
    """Paid in full at the wanted turn, less by a Gaussian of the error."""
    turn_width: Positive = 0.27
    """Standard deviation of that Gaussian [rad/s]."""
    relative_turn: NotNegative = 0.4
    """Paid in full at the wanted turn, less by the error relative to it: without it none turns on the spot."""
    slowest_turn: Positive = 0.3
    """Least turn that errors are relative to [rad/s]."""
    tilt: NotNegative = 1.0
    """Times the tilt."""
    change: NotNegative = 0.15
    """Times the mean squared change of the action."""
    effort: NotNegative = 0.02
    """Times the mean squared action."""
    crouch: NotNegative = 1.5
    """Times the height that is missing, as a share, beyond the one that is free."""
    crouch_free: Share = 0.15
    """Share of the height that may be missing."""
    stir: NotNegative = 0.03
    """Times the mean squared joint velocity while none is commanded: who is told nothing stands still."""
    drag: NotNegative = 0.4
    """Per m/s of feet that slide: who moves a foot lifts it."""
    alive: NotNegative = 0.2
    """Paid as long as it has not fallen."""
    fall: NotNegative = 1.0
    """Price of a fall."""


def walking_reward(
    command: Float[AnyArray, "*batch 3"],
    stride: Stride,
    action: Float[AnyArray, "*batch joint"],
    last_action: Float[AnyArray, "*batch joint"],
    weights: WalkingReward,
    drag_share: float | Float[AnyArray, ""] = 1.0,
) -> Float[AnyArray, "*batch"]:
    """Pay for one control step under a joystick command [m/s, m/s, rad/s]; `drag_share` of the price of dragging."""
    error = stride.speed - command
    miss = jnp.sqrt(jnp.sum(error[..., :2] ** 2, axis=-1) + 1e-6)
    wanted, turn, wanted_turn = (
        jnp.linalg.norm(command[..., :2], axis=-1),
        jnp.abs(error[..., 2]),
        jnp.abs(command[..., 2]),
    )
    is_none = jnp.linalg.norm(command, axis=-1) < NO_COMMAND
    follows = (
        weights.relative * jnp.maximum(1 - miss / jnp.maximum(wanted, weights.slowest), -0.5)
        + weights.speed * jnp.exp(-0.5 * (miss / weights.speed_width) ** 2)
        + weights.turn * jnp.exp(-0.5 * (turn / weights.turn_width) ** 2)
        + weights.relative_turn * jnp.maximum(1 - turn / jnp.maximum(wanted_turn, weights.slowest_turn), -0.5)
    )
    posture = weights.tilt * stride.tilt + weights.crouch * jnp.maximum(1 - weights.crouch_free - stride.height, 0.0)
    effort = weights.effort * jnp.mean(action**2, axis=-1) + weights.change * jnp.mean(
        (action - last_action) ** 2, axis=-1
    )
    stir = weights.stir * is_none * jnp.minimum(stride.stir, 20.0)
    return (
        follows
        - posture
        - effort
        - stir
        - drag_share * weights.drag * stride.drag
        + weights.alive
        - weights.fall * stride.fell
    )
