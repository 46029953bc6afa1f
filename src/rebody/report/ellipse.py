"""Ellipses of Gaussians."""

import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

STDS = 2.0
"""How many standard deviations an ellipse reaches."""


class Outline(NamedTuple):
    """Half axes in the unit of the Gaussian, and the angle of the first [rad]."""

    first: float
    second: float
    angle: float


def outline(covariance: Float[np.ndarray, "2 2"]) -> Outline:
    """The ellipse of two standard deviations."""
    values, vectors = np.linalg.eigh(covariance)
    first, second = STDS * np.sqrt(np.maximum(values, 0.0))
    return Outline(float(first), float(second), math.atan2(vectors[1, 0], vectors[0, 0]))
