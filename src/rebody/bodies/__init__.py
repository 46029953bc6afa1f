"""Anything that moves. Nothing here knows a task."""

from rebody.bodies.batch import RobotBatch
from rebody.bodies.description import load_robot, shipped_robots
from rebody.bodies.point_masses import PointMasses
from rebody.bodies.robot import RobotSpec
from rebody.bodies.simulation import Simulation

__all__ = ["PointMasses", "RobotBatch", "RobotSpec", "Simulation", "load_robot", "shipped_robots"]
