"""The map of the plane, from above: where the robot went, what is hidden, what is believed, what is asked for."""

import html
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from rebody.report.ellipse import STDS, outline
from rebody.tasks import Family, FamilySet
from rebody.tasks.task_file import TaskSpec
from rebody.viewer import colours
from rebody.viewer.session import Session

PX = 300
"""Width and height; its panel scales it."""
SPANS_M = (4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 48.0, 64.0, 96.0)
"""Widths of the plane that are shown: the smallest that holds all, so that the map does not creep."""
FARTHEST_M = 25.0
"""What is believed farther from the robot than this does not stretch the map: first guesses may lie anywhere."""
DRAWN = 400
"""Points of a path at most."""
SPEED, HEADING = 0.22, 0.3
"""Length of an arrow for 1 m/s, and for a heading, as shares of the map."""
LABEL = 'font-size="10" font-family="system-ui, sans-serif"'

Point = tuple[float, float]


@dataclass(frozen=True)
class Target:
    """A task as the map shows it."""

    name: str
    colour: str
    family: Family
    target: tuple[float, ...]
    covariance: Float[np.ndarray, "size size"] | None = None

    def of(self, *components: str) -> Iterator[tuple[str, float]]:
        """Those of its numbers that are about these components."""
        for component, number in zip(self.family.quantity.components, self.target, strict=True):
            if component in components:
                yield component, number

    def spread(self, *components: str) -> Float[np.ndarray, "number number"] | None:
        """Covariance of some of its numbers."""
        names = self.family.quantity.components
        if self.covariance is None or not set(components) <= set(names):
            return None
        of = [names.index(component) for component in components]
        return self.covariance[np.ix_(of, of)]


def draw_map(session: Session) -> str:
    """As SVG."""
    targets = _targets(session, session.trial.in_play)
    frame = _frame(session, targets)
    heading = frame.arrow(session.pose[:2], session.pose[2], 0.09 * frame.span, colours.ROBOT, 3.0)
    path = [tuple(place) for place in np.array(session.path)[:: max(1, len(session.path) // DRAWN)].tolist()]
    shapes = [*frame.grid(), frame.line([*path, session.pose[:2]], colours.ROBOT)]
    for target in targets:
        shapes += _shapes(frame, target, session.pose)
    inner = "".join([*shapes, frame.dot(session.pose[:2], colours.ROBOT, 4.5), heading])
    box = f'viewBox="0 0 {PX} {PX}" style="width:100%;display:block;padding:.3em .7em 0 .7em;box-sizing:border-box"'
    return f'<svg role="img" aria-label="The map of the plane" {box}>{inner}</svg>'


def _targets(session: Session, known: FamilySet) -> list[Target]:
    """The hidden task, then what was believed and asked for at the last decision."""
    task = session.task
    targets = [Target("hidden", colours.HIDDEN, known.named(task.family), task.target)]
    if session.moments:
        reading, subgoal = session.moments[-1].reading, session.moments[-1].subgoal
        family = known.named(reading.family)
        targets.append(Target("believed", colours.BELIEVED, family, reading.target, reading.covariance))
        targets += _subgoal(subgoal, known)
    return targets


def _subgoal(subgoal: TaskSpec | None, known: FamilySet) -> list[Target]:
    return [] if subgoal is None else [Target("subgoal", colours.SUBGOAL, known.named(subgoal.family), subgoal.target)]


def _place(target: Target, pose: Sequence[float]) -> Point | None:
    """Where a target is, if it is a place."""
    asked = dict(target.of("x", "y"))
    return (asked.get("x", pose[0]), asked.get("y", pose[1])) if asked else None


def _frame(session: Session, targets: Sequence[Target]) -> "Frame":
    """The smallest that shows the robot, its path and all places that are near enough."""
    places = [place for target in targets if (place := _place(target, session.pose)) is not None]
    here = session.pose[:2]
    near = [place for place in places if math.dist(place, here) < FARTHEST_M]
    shown = np.array([*session.path, here, *near])
    low, high = shown.min(axis=0), shown.max(axis=0)
    if len(places) < len(targets):  # there are arrows
        room = max(0.25 * float((high - low).max()), 1.0)
        low, high = np.minimum(low, np.subtract(here, room)), np.maximum(high, np.add(here, room))
    wanted = 1.2 * float((high - low).max())
    span = next((each for each in SPANS_M if each >= wanted), wanted)
    middle = np.round(4 * (low + high) / 2 / span) / 4 * span  # it moves on in quarters
    if np.any(np.maximum(high - middle, middle - low) > span / 2):
        middle = (low + high) / 2
    return Frame((float(middle[0]), float(middle[1])), span)


def _shapes(frame: "Frame", target: Target, pose: Sequence[float]) -> list[str]:
    """A place as a mark, a velocity or a heading as an arrow from the robot; how sure it is around its end."""
    here, place = (pose[0], pose[1]), _place(target, pose)
    if place is not None:
        return [*frame.ellipse(place, target.spread("x", "y"), 1.0, target.colour), frame.mark(place, target)]
    turn = pose[2] if target.family.quantity.frame == "heading" else 0.0
    if velocity := dict(target.of("vx", "vy")):
        speeds = complex(velocity.get("vx", 0.0), velocity.get("vy", 0.0)) * complex(math.cos(turn), math.sin(turn))
        scale = SPEED * frame.span
        end = (here[0] + scale * speeds.real, here[1] + scale * speeds.imag)
        arrow = frame.arrow(here, math.atan2(speeds.imag, speeds.real), scale * abs(speeds), target.colour, 2.5)
        spread = target.spread("vx", "vy") if turn == 0.0 else None
        return [*frame.ellipse(end, spread, scale, target.colour), arrow]
    if heading := dict(target.of("yaw")):
        length, width = _heading_of(frame, target.name)
        arrow = frame.arrow(here, heading["yaw"], length, target.colour, width)
        return [*frame.wedge(here, heading["yaw"], target.spread("yaw"), length, target.colour), arrow]
    return []


def _heading_of(frame: "Frame", name: str) -> tuple[float, float]:
    """Length and width of an arrow: those that point alike can all be seen."""
    share, width = {"hidden": (1.0, 2.0), "believed": (0.8, 3.5), "subgoal": (0.6, 5.0)}[name]
    return share * HEADING * frame.span, width


@dataclass(frozen=True)
class Frame:
    """A square of the plane, and shapes on it."""

    middle: Point  # m
    span: float  # m

    def px(self, place: Point) -> Point:
        """x to the right, y up."""
        scale = PX / self.span
        return PX / 2 + scale * (place[0] - self.middle[0]), PX / 2 - scale * (place[1] - self.middle[1])

    def grid(self) -> Iterator[str]:
        """Lines each metre or more, with their numbers, so that there are at most eight."""
        yield f'<rect width="{PX}" height="{PX}" fill="#fafafa" stroke="#cccccc"/>'
        step = next((each for each in (1, 2, 5, 10, 20) if self.span / each <= 8), 50)
        ends = [(middle - self.span / 2, middle + self.span / 2) for middle in self.middle]
        for axis, (low, high) in enumerate(ends):
            for i in range(math.ceil(low / step), math.floor(high / step) + 1):
                place = (float(i * step), float(i * step))
                at = self.px(place)[axis]
                line = f'x1="{at:.1f}" x2="{at:.1f}" y1="0" y2="{PX}"'
                line = line if axis == 0 else f'y1="{at:.1f}" y2="{at:.1f}" x1="0" x2="{PX}"'
                yield f'<line {line} stroke="{"#b8b8b8" if i == 0 else "#e4e4e4"}"/>'
                where = f'x="{at + 2:.1f}" y="{PX - 3}"' if axis == 0 else f'x="2" y="{at - 2:.1f}"'
                unit = " m" if axis == 0 and i == math.ceil(low / step) else ""
                yield f'<text {where} fill="#777777" {LABEL}>{i * step}{unit}</text>'

    def line(self, places: Sequence[Point], colour: str) -> str:
        """A path."""
        points = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(self.px, places))
        return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="1.5" opacity="0.7"/>'

    def dot(self, place: Point, colour: str, radius: float) -> str:
        """A disc of a radius in pixels."""
        x, y = self.px(place)
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:g}" fill="{colour}"/>'

    def mark(self, place: Point, target: Target) -> str:
        """A ring, a disc or a cross, so that those at one place can all be seen."""
        x, y = self.px(place)
        says = f"<title>{html.escape(target.name)}</title>"
        if target.name == "hidden":
            cross = f"M{x - 7:.1f},{y - 7:.1f}l14,14m0,-14l-14,14"
            return f'<path d="{cross}" stroke="{target.colour}" stroke-width="2.5" fill="none">{says}</path>'
        ring = f'fill="none" stroke="{target.colour}" stroke-width="2.5"' if target.name == "subgoal" else ""
        radius, look = (7.5, ring) if ring else (4.0, f'fill="{target.colour}"')
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" {look}>{says}</circle>'

    def ellipse(
        self, place: Point, covariance: Float[np.ndarray, "2 2"] | None, scale: float, colour: str
    ) -> Iterator[str]:
        """Two standard deviations about a place, of what is drawn at so many metres for a unit."""
        if covariance is None:
            return
        (x, y), (first, second, angle) = self.px(place), outline(covariance)
        size = scale * PX / self.span
        radii = f'rx="{min(size * first, 9e3):.1f}" ry="{min(size * second, 9e3):.1f}"'
        turned = f'transform="translate({x:.1f},{y:.1f}) rotate({-math.degrees(angle):.1f})"'
        yield f'<ellipse {radii} {turned} fill="{colour}" fill-opacity="0.12" stroke="{colour}"/>'

    def wedge(
        self, place: Point, angle: float, covariance: Float[np.ndarray, "1 1"] | None, length: float, colour: str
    ) -> Iterator[str]:
        """Two standard deviations about a heading."""
        if covariance is None:
            return
        off = min(STDS * math.sqrt(max(covariance[0, 0], 0.0)), math.pi)
        (x, y), size = self.px(place), length * PX / self.span
        points = [(x + size * math.cos(a), y - size * math.sin(a)) for a in np.linspace(angle - off, angle + off, 24)]
        outlined = " ".join(f"{u:.1f},{v:.1f}" for u, v in [(x, y), *points])
        yield f'<polygon points="{outlined}" fill="{colour}" fill-opacity="0.12" stroke="none"/>'

    def arrow(self, place: Point, angle: float, length: float, colour: str, width: float) -> str:
        """From a place, so many metres long."""
        end = (place[0] + length * math.cos(angle), place[1] + length * math.sin(angle))
        (x, y), (u, v) = self.px(place), self.px(end)
        head = [(u + 9 * math.cos(angle + turn), v - 9 * math.sin(angle + turn)) for turn in (2.6, -2.6)]
        tip = f"M{head[0][0]:.1f},{head[0][1]:.1f}L{u:.1f},{v:.1f}L{head[1][0]:.1f},{head[1][1]:.1f}"
        shape = f"M{x:.1f},{y:.1f}L{u:.1f},{v:.1f}{tip}"
        return f'<path d="{shape}" stroke="{colour}" stroke-width="{width:g}" fill="none" opacity="0.85"/>'
