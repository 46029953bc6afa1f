"""Pictures of the plane: paths with what is believed on the way, velocities, and headings on a circle."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse

from rebody.agents.belief import Reading
from rebody.evaluation.episode import EpisodeResult
from rebody.report.ellipse import outline
from rebody.report.style import BELIEF, MOTION, TRUTH
from rebody.tasks import Family
from rebody.types import POSE_FIELDS, RATE_FIELDS

SMALLEST_M = 3.0
"""Width of a map at least."""
AT = (4, 9, 14, 19, 29, 49)
"""Decisions whose belief has an ellipse on the map of a whole episode: after 0.5, 1, 1.5, 2, 3 and 5 s."""
ARROW, PER_SPEED = 0.12, 0.2
"""Lengths of the arrow of a heading, and of 1 m/s, as shares of a map."""
INNER = 0.25
"""Radius at which time begins on a circle of headings; it ends at 1."""


def is_plane(family: Family) -> bool:
    """Whether its targets are points of a plane: places, or velocities."""
    names = set(family.quantity.components)
    return family.size == 2 and (names <= set(POSE_FIELDS[:3]) or names <= set(RATE_FIELDS[:3]))


def is_heading(family: Family) -> bool:
    """Whether its targets are directions."""
    return family.quantity.components == ("yaw",)


def path_of(episode: EpisodeResult) -> Float[np.ndarray, "time 2"] | None:
    """Where the robot was after each decision [m], if it is said."""
    return _series_of(episode, ("x", "y"))


def headings_of(episode: EpisodeResult) -> Float[np.ndarray, "time 1"] | None:
    """Where it headed [rad]."""
    return _series_of(episode, ("yaw",))


def _series_of(episode: EpisodeResult, components: tuple[str, ...]) -> Float[np.ndarray, "time size"] | None:
    for family in episode.families:
        if family.quantity.components == components and family.quantity.name in episode.quantities:
            return np.reshape(np.array(episode.quantities[family.quantity.name], float), (-1, family.size))
    return None


def draw_map(
    axes: Axes, episode: EpisodeResult, readings: Sequence[Reading] | None = None, until: int | None = None
) -> None:
    """From above, up to a decision: path and heading, the hidden task, and what was believed.

    Of a whole episode the beliefs of its first seconds, else the newest one.
    """
    path, headings = path_of(episode), headings_of(episode)
    assert path is not None
    now = len(path) - 1 if until is None else min(until, len(path)) - 1
    span = _square(axes, episode, path)
    axes.plot(*path[0], "o", color="0.6", ms=4)
    axes.plot(*path[: now + 1].T, color=MOTION, lw=1.5, label="robot")
    _believed(axes, episode, readings, now, until is None)
    if headings is not None:
        _arrow(axes, path[now], headings[now, 0], ARROW * span, MOTION)
    hidden = episode.families.named(episode.active_family[now])
    _target(axes, hidden, np.array(episode.active_target[now]), path[now], span, TRUTH, "hidden target")


def _square(axes: Axes, episode: EpisodeResult, path: Float[np.ndarray, "time 2"]) -> float:
    """Limits that hold the whole path, all hidden places and believed ones that are not far off; the width [m]."""
    shown = np.array([*path, *_places(episode, episode.active_family, episode.active_target)])
    middle, size = (shown.min(axis=0) + shown.max(axis=0)) / 2, float(np.ptp(shown, axis=0).max())
    believed = _places(episode, episode.inferred_family, episode.inferred_target)
    near = [place for place in believed if np.abs(place - middle).max() < max(size, SMALLEST_M)]
    shown = np.array([*shown, *near])
    low, high = shown.min(axis=0), shown.max(axis=0)
    span = max(1.2 * float((high - low).max()), SMALLEST_M)
    for set_ends, middle in zip((axes.set_xlim, axes.set_ylim), (low + high) / 2, strict=True):
        set_ends(middle - span / 2, middle + span / 2)
    axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal")
    return span


def _places(episode: EpisodeResult, named: list[str], targets: list[list[float]]) -> list[Float[np.ndarray, " 2"]]:
    """Those among the targets."""
    both = zip(named, targets, strict=True)
    return [np.array(target) for name, target in both if is_place(episode.families.named(name))]


def is_place(family: Family) -> bool:
    """Whether its targets are places."""
    return family.quantity.components == ("x", "y")


def _believed(axes: Axes, episode: EpisodeResult, readings: Sequence[Reading] | None, now: int, is_whole: bool) -> None:
    """Believed places, and two standard deviations about some of them, or the newest."""
    families = [episode.families.named(name) for name in episode.inferred_family]
    chosen = [i for i in range(now + 1) if is_place(families[i])]
    if chosen:
        places = np.array([episode.inferred_target[i] for i in chosen])
        axes.plot(*places.T, ".", color=BELIEF, ms=4, label="believed")
    elif not is_whole:
        path = path_of(episode)
        assert path is not None
        span = float(np.ptp(axes.get_xlim()))
        target = np.array(episode.inferred_target[now])
        _target(axes, families[now], target, path[now], span, BELIEF, "believed")
    if readings is not None:
        draw_ellipses(axes, readings, chosen, AT if is_whole else (now,))


def draw_ellipses(axes: Axes, readings: Sequence[Reading], chosen: Sequence[int], at: Sequence[int] = AT) -> None:
    """Two standard deviations of believed targets of two numbers, those chosen at some decisions."""
    for i in at:
        if i in chosen:
            axes.add_artist(ellipse_of(readings[i]))


def ellipse_of(reading: Reading, colour: Any = BELIEF) -> Ellipse:
    """Two standard deviations of a target of two numbers."""
    first, second, angle = outline(reading.covariance)
    x, y = reading.target
    return Ellipse((x, y), 2 * first, 2 * second, angle=np.degrees(angle), fill=False, edgecolor=colour, lw=1.0)


def _target(
    axes: Axes,
    family: Family,
    target: Float[np.ndarray, " size"],
    here: Float[np.ndarray, " 2"],
    span: float,
    colour: str,
    label: str,
) -> None:
    """A place as a cross, a velocity or a heading as an arrow from the robot."""
    if is_place(family):
        axes.plot(*target, "x", color=colour, ms=9, mew=2, label=label)
    elif is_plane(family):
        _arrow(axes, here, float(np.arctan2(*target[::-1])), PER_SPEED * span * float(np.hypot(*target)), colour, label)
    elif is_heading(family):
        _arrow(axes, here, target[0], 2 * ARROW * span, colour, label)


def _arrow(
    axes: Axes, here: Float[np.ndarray, " 2"], angle: float, length: float, colour: str, label: str | None = None
) -> None:
    x, y = here.tolist()
    end = (x + length * np.cos(angle), y + length * np.sin(angle))
    look = {"arrowstyle": "-|>", "color": colour, "lw": 1.5, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", end, (x, y), arrowprops=look)
    if label:
        axes.plot([], [], color=colour, label=label)


def draw_circle(
    axes: Axes,
    time_s: Float[np.ndarray, " time"],
    reached: Float[np.ndarray, " time"],
    wanted: Float[np.ndarray, " time"],
    read: Float[np.ndarray, " time"],
    until: int | None = None,
) -> None:
    """Headings as directions, time from within to the rim: the robot's, the hidden and the believed one."""
    radius = _radius(time_s)
    axes.plot(radius * np.cos(wanted), radius * np.sin(wanted), "--", color=TRUTH, label="hidden target")
    across, up = radius * np.cos(read), radius * np.sin(read)
    axes.plot(across[:until], up[:until], ".", color=BELIEF, ms=4, label="read from the belief")
    across, up = radius * np.cos(reached), radius * np.sin(reached)
    axes.plot(across[:until], up[:until], color=MOTION, lw=1.5, label="robot")
    draw_rim(axes, float(time_s[-1]))


def draw_turn(
    axes: Axes, time_s: Float[np.ndarray, " time"], reached: Float[np.ndarray, " time"], target: float, colour: Any
) -> None:
    """One of many on the same circle: a line, and its target on the rim."""
    radius = _radius(time_s)
    axes.plot(radius * np.cos(reached), radius * np.sin(reached), color=colour, lw=1.2)
    axes.plot(1.04 * np.cos(target), 1.04 * np.sin(target), "o", color=colour, ms=4)


def _radius(time_s: Float[np.ndarray, " time"]) -> Float[np.ndarray, " time"]:
    return INNER + (1 - INNER) * time_s / time_s[-1]


def draw_rim(axes: Axes, seconds: float) -> None:
    """Where time begins and ends, and what directions are called."""
    turn = np.linspace(0, 2 * np.pi, 120)
    for each in (INNER, 1.0):
        axes.plot(each * np.cos(turn), each * np.sin(turn), color="0.85", lw=1.0, zorder=0)
    for angle, name in ((0.0, "0"), (np.pi / 2, "π/2"), (np.pi, "π"), (-np.pi / 2, "-π/2")):
        axes.text(1.12 * np.cos(angle), 1.12 * np.sin(angle), name, ha="center", va="center", fontsize=8)
    axes.set(xlim=(-1.25, 1.25), ylim=(-1.25, 1.25), aspect="equal", xticks=[], yticks=[])
    axes.set_xlabel(f"heading [rad]; time from within (0 s) to the rim ({seconds:g} s)")
    axes.spines[:].set_visible(False)
