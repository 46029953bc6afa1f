"""Robots that walk already: a maker's policy that follows a joystick, as a part of the body."""

from rebody.bodies.walking.joystick import Joystick
from rebody.bodies.walking.settings import Walking

__all__ = ["Joystick", "Walking"]
