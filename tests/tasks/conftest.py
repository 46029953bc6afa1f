"""Families of two numbers, beside those of the line."""

import numpy as np
import pytest

from rebody.ranges import Box
from rebody.tasks import Direction, Family, FamilySet, Quantity
from rebody.tasks.line import GOAL, VELOCITY

SECTORS = tuple(
    Direction(name, towards)
    for name, towards in (("east", (1.0, 0.0)), ("north", (0.0, 1.0)), ("west", (-1.0, 0.0)), ("south", (0.0, -1.0)))
)
PLACE = Family(
    name="place",
    quantity=Quantity("xy", ("x", "y"), "m", "place"),
    targets=(Box((-6.0, -4.0), (6.0, 4.0)),),
    floor=1.0,
    tolerance=0.3,
    directions=SECTORS,
)
"""A point of the plane."""
LEAN = Family(
    name="lean",
    quantity=Quantity("x_yaw", ("x", "yaw"), "m, rad", "place and heading"),
    targets=(Box((1.0, -3.0), (4.0, 3.0)), Box((-4.0, 0.0), (-1.0, 0.0))),
    floor=0.5,
    tolerance=0.3,
    law="plain",
)
"""A place on the line and a heading."""
DRIFT = Family(
    name="drift",
    quantity=Quantity("along", ("vx", "vy"), "m/s", "speed along and across", frame="heading"),
    targets=(Box((-1.0, -1.0), (1.0, 1.0)),),
    floor=0.5,
    tolerance=0.2,
    settle="mean of 1 s",
)
"""Speeds along and across the heading."""


@pytest.fixture(scope="session")
def mixed() -> FamilySet:
    """Families of one number and of two."""
    return FamilySet((GOAL, PLACE, VELOCITY, LEAN, DRIFT))


def of_size(vector, size: int = 2):
    """With zeros behind, as a set of families of two numbers has it."""
    return np.concatenate([vector, np.zeros(size - len(vector))])
