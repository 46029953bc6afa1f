"""Anything that moves. Nothing here knows a task."""

import difflib

from rebody.bodies.cheetah import cheetah
from rebody.bodies.robot import RobotBatch, RobotSpec
from rebody.errors import RebodyError

ROBOTS = {"cheetah": cheetah}
"""Factories of the shipped robots, by name."""


def load_robot(name: str) -> RobotSpec:
    """A shipped robot; RebodyError if there is none of that name."""
    if name not in ROBOTS:
        near = difflib.get_close_matches(name, ROBOTS, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else "."
        raise RebodyError(f"unknown robot '{name}'{hint} Robots are: {', '.join(ROBOTS)}.")
    return ROBOTS[name]()


__all__ = ["ROBOTS", "RobotBatch", "RobotSpec", "load_robot"]
