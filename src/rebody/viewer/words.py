"""What the page says."""

import base64
import html
import io
from collections.abc import Sequence
from itertools import cycle

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from rebody.names import AGENTS
from rebody.tasks import Family, FamilySet
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Moment, Session

INTRODUCTION = """
The robot has a **hidden task**. All it hears is a reward: how far off it is. A module that learned on a point mass
works out what is wanted. **Change the task, push the robot**, and watch.
"""
GUIDE = """
**In the middle.** The robot; the view follows it along *x*, drag to turn, scroll to zoom. Poles mark places [m], arrows
speeds [m/s], or point to a place that is farther away than the picture shows.

**Black, dashed: the hidden task.** {kinds}.

**Red: the belief**, as it is read from the module's latent, and how sure it is of the kind. It begins with a guess.

**Orange: the subgoal** that the agent asks of the robot's tracker, a policy that moves the joints, or of the navigator,
which moves a robot's joystick.

**Blue: the robot**, what it reaches.

**Map**, where there is a plane, from above: the robot's path and heading; a cross for the hidden place, a dot for the
believed one, a ring for the subgoal. Velocities and headings are arrows from the robot. The ellipse is what the rewards
leave open, two standard deviations of it; it is a first-order estimate, and long where the robot has hardly looked.

**Probability.** Which base task the module believes in: a kind, and the direction of its target (dashes).

**Latent.** Each dot is a belief, ten per second, in the colour of the believed kind; the red ellipse is the newest
one's uncertainty. Grey ellipses are clusters that the module found on the point mass, without labels. All ellipses
reach two standard deviations.

**Agents.** {agents}. Whoever acts, the module listens, and its belief is what is drawn.
"""
DASHES = ("solid", "dashed", "long dashes", "dotted")
"""Lines of a family's last direction, the one before and so on, by turns."""


def guide(families: FamilySet) -> str:
    """All that is seen, where the module knows these families, as Markdown."""
    kinds = "; ".join(f"*{family.name}*: {html.escape(family.label)}" for family in families)
    return GUIDE.format(kinds=kinds, agents="; ".join(f"*{name}*: {what}" for name, what in AGENTS.items()))


def dot(colour: str) -> str:
    """A small disc in front of a word, as HTML."""
    return (
        f'<span style="display:inline-block;width:.7em;height:.7em;border-radius:50%;background:{colour};'
        'margin-right:.45em"></span>'
    )


def loading(robot: str) -> str:
    """While parts are fetched and compiled, as HTML."""
    return _line(f"<b>Getting {html.escape(robot)} ready</b>: fetching its parts and compiling, some seconds…")


def status(session: Session, speed: float, is_paused: bool) -> str:
    """What goes on, as HTML."""
    going = "paused" if is_paused else f"{speed:.1f} x real time" if speed else "starting"
    fallen = '<br><b style="color:#c0392b">It has fallen. Press Restart.</b>' if session.body.fallen.any() else ""
    doubts = session.moments[-1].doubts if session.moments else ()
    doubtful = "".join(f'<br><b style="color:#c0392b">Doubtful:</b> {html.escape(doubt)}' for doubt in doubts)
    return _line(f"<b>{session.time_s:.1f} s</b>, {going}{fallen}{doubtful}")


def _line(html_text: str) -> str:
    return f'<div style="font-size:.82em;padding:0 0 .3em 1em">{html_text}</div>'


def family_legend(families: FamilySet) -> str:
    """Which line is which, as HTML."""
    names = " &nbsp; ".join(dot(family.colour) + family.name for family in families)
    directions = dict.fromkeys(family.direction_names[::-1] for family in families if family.directions)
    lines = (", ".join(f"{dash}: {name}" for dash, name in zip(cycle(DASHES), each)) for each in directions)
    return _line(f"Kind of task: {names} &nbsp; " + " &nbsp; ".join(f"({line})" for line in lines))


def numbers(families: FamilySet, task: TaskSpec, moment: Moment | None) -> str:
    """The numbers of this moment, in the colours of the plots, as HTML."""

    def named(family: str, target: Sequence[float]) -> str:
        return f"{family} {value(families.named(family), target)}"

    rows = [(colours.HIDDEN, "hidden task", named(task.family, task.target))]
    believed = reached = "nothing yet"
    if moment is not None:
        reading = moment.reading
        chance = reading.probabilities[reading.family]
        believed = f"{named(reading.family, reading.target)} ({100 * chance:.0f} % sure)"
        reached = value(families.named(task.family), moment.reached[task.family])
    rows += [(colours.BELIEVED, "believed", believed), (colours.ROBOT, "robot", reached)]
    if moment is not None and moment.subgoal is not None:
        rows.append((colours.SUBGOAL, "subgoal", named(moment.subgoal.family, moment.subgoal.target)))
    lines = "".join(f"<tr><td>{dot(c)}{name}</td><td><b>{says}</b></td></tr>" for c, name, says in rows)
    return f'<table style="font-size:.82em;line-height:1.35;margin-left:.9em">{lines}</table>'


def picture(pixels: UInt8[np.ndarray, "height width 3"], says: str) -> str:
    """A picture as wide as its panel, as HTML. (viser's own images may be gone before a slow browser has read them.)"""
    png = io.BytesIO()
    Image.fromarray(pixels).save(png, "png", compress_level=1)
    data = base64.b64encode(png.getvalue()).decode()
    # decoded at once, since the picture before is gone: it would flicker
    style = "width:100%;padding:.3em .7em 0 .7em"
    return f'<img alt="{says}" decoding="sync" style="{style}" src="data:image/png;base64,{data}">'


def value(family: Family, target: Sequence[float]) -> str:
    """Numbers with their unit, as HTML."""
    return f"{', '.join(f'{number:+.2f}' for number in target)} {html.escape(family.unit)}"
