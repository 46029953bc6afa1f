"""What the page says."""

import base64
import html
import io
from collections.abc import Sequence

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from rebody.names import AGENTS
from rebody.tasks import FAMILIES, family_named
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Moment, Session

INTRODUCTION = """
The robot has a **hidden task**. All it hears is a reward: how far off it is. A module that learned on a point mass
works out what is wanted. **Change the task, push the robot**, and watch.
"""
GUIDE = f"""
**In the middle.** The robot; the view follows it along *x*, drag to turn, scroll to zoom. Poles mark goals [m], arrows
speeds [m/s], or point to a goal that is farther away than the picture shows.

**Black, dashed: the hidden task.** {"; ".join(f"*{family.name}*: {family.asks}" for family in FAMILIES)}.

**Red: the belief**, as a linear probe reads it from the module's latent, and how sure it is of the kind. It begins with
a guess.

**Orange: the subgoal** that the agent asks of the robot's tracker, a policy that moves the joints.

**Blue: the robot**, what it reaches.

**Probability.** Which base task the module believes in: a kind, and whether its target is positive (solid) or negative
(dashed).

**Latent.** Each dot is a belief, ten per second, in the colour of the believed kind; the red ellipse is the newest
one's uncertainty. Grey ellipses are clusters that the module found on the point mass, without labels. All ellipses
reach two standard deviations.

**Agents.** {"; ".join(f"*{name}*: {what}" for name, what in AGENTS.items())}. Whoever acts, the module listens, and its
belief is what is drawn.
"""


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


def family_legend(families: Sequence[str]) -> str:
    """Which line is which, as HTML."""
    names = " &nbsp; ".join(dot(family_named(family).colour) + family for family in families)
    return _line(f"Kind of task: {names} &nbsp; (dashed: negative)")


def numbers(task: TaskSpec, moment: Moment | None) -> str:
    """The numbers of this moment, in the colours of the plots, as HTML."""
    rows = [(colours.HIDDEN, "hidden task", named(task.family, task.target))]
    believed = reached = "nothing yet"
    if moment is not None:
        reading = moment.reading
        chance = reading.probabilities[reading.family]
        believed = f"{named(reading.family, reading.target)} ({100 * chance:.0f} % sure)"
        reached = value(task.family, moment.reached[task.family])
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


def named(family: str, target: float) -> str:
    """A task in words."""
    return f"{family} {value(family, target)}"


def value(family: str, number: float) -> str:
    """A number with its unit."""
    return f"{number:+.2f} {family_named(family).unit}"
