"""Colours of the page, alike in the scene, the plots and the text."""

from rebody.report.style import BELIEF, MOTION, TRUTH

HIDDEN, BELIEVED, ROBOT, SUBGOAL = TRUTH, BELIEF, MOTION, "#e07a1f"


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue from 0 to 255 of a colour #rrggbb."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
