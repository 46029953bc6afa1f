"""The families of the line (thesis 6.3-6.5, B.2): a place, a speed and a pitch to reach, a jump."""

from math import pi

from rebody.ranges import Box, interval
from rebody.tasks.family import Direction, Family
from rebody.tasks.family_set import FamilySet
from rebody.tasks.quantities import Quantity

BOTH_WAYS = (Direction("back", (-1.0,)), Direction("front", (1.0,)))


def both_ways(low: float, high: float) -> tuple[Box, Box]:
    """Targets of these sizes in front and at the back."""
    return interval(low, high), interval(-high, -low)


GOAL = Family(
    name="goal",
    quantity=Quantity("x", ("x",), "m", "position x"),
    targets=both_ways(2.0, 15.0),
    floor=1.0,
    tolerance=0.25,
    label="reach a position",
    colour="#6a4c93",
    directions=BOTH_WAYS,
)
# Velocities in a global state are means over the last decision, which is what rewards use.
VELOCITY = Family(
    name="velocity",
    quantity=Quantity("vx", ("vx",), "m/s", "velocity"),
    targets=both_ways(1.0, 3.0),
    floor=0.5,
    tolerance=0.25,
    settle="mean of 1 s",
    label="run at a speed",
    colour="#3f8f63",
    directions=BOTH_WAYS,
)
STAND = Family(
    name="stand",
    quantity=Quantity("pitch", ("pitch",), "rad", "pitch"),
    targets=both_ways(pi / 6, pi / 2),
    floor=0.3,
    tolerance=0.2,
    label="hold a pitch",
    colour="#b08900",
    directions=BOTH_WAYS,
)
JUMP = Family(
    name="jump",
    quantity=Quantity("vz", ("vz",), "m/s", "vertical speed"),
    targets=(interval(1.5, 3.0),),
    floor=0.5,
    tolerance=0.4,
    settle="largest of 1 s",
    label="leave the floor at a speed",
    colour="#b5527a",
    directions=BOTH_WAYS,
)

LINE = FamilySet((GOAL, VELOCITY, STAND, JUMP))
