"""Anything that moves. Nothing here knows a task."""

from rebody.bodies.batch import RobotBatch
from rebody.bodies.description import load_robot, shipped_robots
from rebody.bodies.robot import RobotSpec

__all__ = ["RobotBatch", "RobotSpec", "load_robot", "shipped_robots"]
