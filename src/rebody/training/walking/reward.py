"""What a walking policy is paid for a control step."""

from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Float

from rebody.bodies.walking.joints import NO_COMMAND
from rebody.ranges import NotNegative, Positive, Share
from rebody.training.walking.stride import Stride
from rebody.types import AnyArray

MOST_STIR = 20.0
"""No mean squared joint velocity beyond this costs more [rad^2/s^2]."""


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
    sway: NotNegative = 0.3
    """Metres per radian: who turns is paid by errors of the speed relative to so much of the wanted turn at least."""
    weave: NotNegative = 0.8
    """Radians per metre: who walks is paid by errors of the turn relative to so much of the wanted speed at least."""
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
    drag: NotNegative = 0.1
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
    error, is_none = stride.speed - command, jnp.linalg.norm(command, axis=-1) < NO_COMMAND
    miss, turn = jnp.sqrt(jnp.sum(error[..., :2] ** 2, axis=-1) + 1e-6), jnp.abs(error[..., 2])
    wanted, wanted_turn = jnp.linalg.norm(command[..., :2], axis=-1), jnp.abs(command[..., 2])
    size = jnp.maximum(jnp.maximum(wanted, weights.slowest), weights.sway * wanted_turn)
    size_turn = jnp.maximum(jnp.maximum(wanted_turn, weights.slowest_turn), weights.weave * wanted)
    follows = (
        weights.relative * jnp.maximum(1 - miss / size, -0.5)
        + weights.speed * jnp.exp(-0.5 * (miss / weights.speed_width) ** 2)
        + weights.relative_turn * jnp.maximum(1 - turn / size_turn, -0.5)
        + weights.turn * jnp.exp(-0.5 * (turn / weights.turn_width) ** 2)
    )
    missing = jnp.maximum(1 - weights.crouch_free - stride.height, 0.0)
    price = (
        weights.tilt * stride.tilt
        + weights.crouch * missing
        + weights.effort * jnp.mean(action**2, axis=-1)
        + weights.change * jnp.mean((action - last_action) ** 2, axis=-1)
        + weights.stir * is_none * jnp.minimum(stride.stir, MOST_STIR)
        + drag_share * weights.drag * stride.drag
        + weights.fall * stride.fell
    )
    return follows - price + weights.alive
