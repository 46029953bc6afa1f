"""Attitudes: angles that wrap, and quaternions, of which one and its negative are the same attitude."""

from typing import Any

import jax
import numpy as np
from jaxtyping import Float

Floats = Float[np.ndarray, "..."]
Quaternions = Float[np.ndarray, "... 4"]
"""Real part first, of length 1."""


def wrap_angle(angle: Any) -> Any:
    """An angle in (-pi, pi], of NumPy or JAX [rad]."""
    wrapped = -((np.pi - angle) % (2 * np.pi) - np.pi)
    return wrapped if isinstance(angle, jax.Array) else np.asarray(wrapped, angle.dtype)


def product(first: Quaternions, second: Quaternions) -> Quaternions:
    """The turn by `second`, then by `first`."""
    real, imaginary = first[..., :1], first[..., 1:]
    other, others = second[..., :1], second[..., 1:]
    turned = real * others + other * imaginary + np.cross(imaginary, others)
    return np.concatenate([real * other - (imaginary * others).sum(-1, keepdims=True), turned], axis=-1)


def inverse(attitude: Quaternions) -> Quaternions:
    """The turn back."""
    return attitude * [1.0, -1.0, -1.0, -1.0]


def positive(attitude: Quaternions) -> Quaternions:
    """Of the two quaternions of an attitude the one with a real part that is not negative."""
    return attitude * np.where(attitude[..., :1] < 0, -1.0, 1.0)


def about_z(angle: Floats) -> Quaternions:
    """The turn by an angle about z [rad]."""
    still = np.zeros_like(angle)
    return np.stack([np.cos(angle / 2), still, still, np.sin(angle / 2)], axis=-1)


def roll_pitch_yaw(attitude: Quaternions) -> Float[np.ndarray, "... 3"]:
    """Its angles as `rebody.types.GlobalState` has them, in (-pi, pi] [rad]."""
    w, x, y, z = np.moveaxis(attitude, -1, 0)
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return wrap_angle(np.stack([roll, pitch, yaw], axis=-1))


def up_axis(attitude: Quaternions) -> Float[np.ndarray, "... 3"]:
    """The world's up in the body's frame: the same at every heading."""
    w, x, y, z = np.moveaxis(attitude, -1, 0)
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=-1)


def in_heading(plane: Float[np.ndarray, "... 2"], yaw: Floats) -> Float[np.ndarray, "... 2"]:
    """A vector along the world's x and y as it is ahead and to the left of a body with that heading [rad]."""
    x, y = np.moveaxis(plane, -1, 0)
    return np.stack([np.cos(yaw) * x + np.sin(yaw) * y, np.cos(yaw) * y - np.sin(yaw) * x], axis=-1)
