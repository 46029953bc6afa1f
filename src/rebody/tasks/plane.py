"""The families of the plane (thesis 6.6: f_x and f_y): a place and a velocity of any direction, a heading."""

from math import pi

from rebody.ranges import Box, interval
from rebody.tasks.family import Direction, Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.quantities import Quantity

AROUND = (
    Direction("front", (1.0, 0.0)),
    Direction("left", (0.0, 1.0)),
    Direction("back", (-1.0, 0.0)),
    Direction("right", (0.0, -1.0)),
)


def ring(inner: float, outer: float) -> Box:
    """Vectors of these lengths in any direction."""
    return Box((inner, -pi), (outer, pi), polar=True)


PLACE = Family(
    name="place",
    quantity=Quantity("position_xy", ("x", "y"), "m", "place"),
    targets=(ring(2.0, 15.0),),
    floor=1.0,
    tolerance=0.25,
    label="reach a place",
    colour="#22577a",
    directions=AROUND,
)
VELOCITY_XY = Family(
    name="velocity_xy",
    quantity=Quantity("velocity_xy", ("vx", "vy"), "m/s", "velocity in the plane"),
    targets=(ring(0.3, 2.0),),
    floor=0.5,
    tolerance=0.25,
    settle="mean of 1 s",
    label="move at a velocity",
    colour="#c8553d",
    directions=AROUND,
)
HEADING = Family(
    name="heading",
    quantity=Quantity("yaw", ("yaw",), "rad", "heading"),
    targets=(interval(-pi, pi),),
    floor=0.5,
    tolerance=0.2,
    label="face a direction",
    colour="#588b8b",
    directions=(
        Direction("front", (0.0,)),
        Direction("left", (pi / 2,)),
        Direction("back", (pi,)),
        Direction("right", (-pi / 2,)),
    ),
)

PLANE = FamilySet((PLACE, VELOCITY_XY, HEADING))
