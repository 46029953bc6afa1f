"""Colours of the page, alike in the scene, the plots and the text."""

from rebody.report.style import BELIEF, MOTION, SHADES, TRUTH

HIDDEN, BELIEVED, ROBOT, SUBGOAL = TRUTH, BELIEF, MOTION, "#e07a1f"


def shade(colour: str, component: int) -> str:
    """A colour #rrggbb for one of a vector's components: the first is in full colour."""
    return f"{colour}{round(255 * SHADES[component % len(SHADES)]):02x}"


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue from 0 to 255 of a colour #rrggbb."""
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue
