"""Anything that moves. Nothing here knows a task."""

from rebody.bodies.description import load_robot, shipped_robots
from rebody.bodies.robot import RobotBatch, RobotSpec

__all__ = ["RobotBatch", "RobotSpec", "load_robot", "shipped_robots"]
