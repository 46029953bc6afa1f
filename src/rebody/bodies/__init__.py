"""Anything that moves. Nothing here knows a task."""

from rebody.bodies.batch import RobotBatch
from rebody.bodies.description import load_robot, shipped_robots
from rebody.bodies.point_masses import PointMasses
from rebody.bodies.robot import RobotSpec
from rebody.bodies.simulation import Simulation
from rebody.bodies.walking.batch import WalkingBatch

__all__ = ["PointMasses", "RobotBatch", "RobotSpec", "Simulation", "load_robot", "shipped_robots", "simulate"]


def simulate(spec: RobotSpec, size: int, threads: int = 0) -> RobotBatch:
    """Many copies of a robot, one that walks by its own policy or not; `threads` = 0 uses every processor."""
    return (RobotBatch if spec.walking is None else WalkingBatch)(spec, size, threads)
