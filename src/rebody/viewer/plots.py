"""The plots over time: target against reached value, and the probabilities of the base tasks."""

from collections.abc import Sequence

import numpy as np
import viser
from jaxtyping import Float
from viser import uplot

from rebody.tasks import FAMILIES, family_named
from rebody.types import DECISION_DT
from rebody.viewer import colours
from rebody.viewer.session import REMEMBERED_S, Moment

Series = tuple[Float[np.ndarray, " time"], ...]
FONT = "11px system-ui, sans-serif"
REACHED_PX, PROBABILITY_PX, PADDING = 135, 88, (6, 12, 0, 0)
BEHIND = (3, 3)
"""Dashes of a line that is about negative targets [pixels]."""
LOOSE: uplot.Series = {"auto": False}
"""Has no say in where its axis ends."""


def reached_series(moments: Sequence[Moment], family: str) -> Series:
    """Time [s]; then the robot's value, the hidden target and the believed one, in the family's unit.

    NaN where there is none: a target of another family, a time that is still to come. Only the last stretch of a
    hidden family is shown, so that a line has no gaps.
    """
    elsewhere = [i for i, moment in enumerate(moments) if moment.task.family != family]
    begins = elsewhere[-1] + 1 if elsewhere else 0
    robot = [moment.reached[family] for moment in moments]
    hidden = [moment.task.target if i >= begins else np.nan for i, moment in enumerate(moments)]
    believed = [moment.reading.target if moment.reading.family == family else np.nan for moment in moments]
    return _on_one_axis(moments, [robot, hidden, believed])


def limits(values: Sequence[Float[np.ndarray, " time"]], family: str) -> tuple[float, float]:
    """Ends of an axis, around 0 and all values."""
    shown = np.append(np.concatenate(values), 0.0)
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    margin = 0.1 * max(high - low, family_named(family).floor)
    return low - margin, high + margin


def probability_series(moments: Sequence[Moment], base_tasks: Sequence[tuple[str, int]]) -> Series:
    """Time [s], and the probability of each base task."""
    return _on_one_axis(moments, [[m.reading.base_tasks[each] for m in moments] for each in base_tasks])


def _on_one_axis(moments: Sequence[Moment], values: list[list[float]]) -> Series:
    """Of full length from the start on, so that the axis moves only when it must."""
    length = round(REMEMBERED_S / DECISION_DT)
    first = moments[0].time_s if moments else DECISION_DT
    empty = [np.nan] * (length - len(moments))
    return first + DECISION_DT * np.arange(length), *(np.array([*each, *empty], float) for each in values)


class ReachedPlot:
    """What the robot reaches, what is hidden, what is believed."""

    def __init__(self, gui: viser.GuiApi):
        self._family = FAMILIES[0].name
        hidden, robot, believed = colours.HIDDEN, colours.ROBOT, colours.BELIEVED
        self._plot = gui.add_uplot(
            data=_with_limits(reached_series([], self._family), self._family),
            series=(
                {},
                {**LOOSE, "label": "robot", "stroke": robot, "width": 2, "points": {"show": False}},
                {**LOOSE, "label": "hidden", "stroke": hidden, "width": 1.5, "dash": (6, 4), "points": {"show": False}},
                # dots, since a belief jumps
                {**LOOSE, "label": "believed", "width": 0, "points": _dots(believed)},
                {"width": 0, "points": {"show": False}},
            ),
            scales={"x": {"time": False}},
            axes=_axes(_label(self._family)),
            legend={"show": False},
            height=REACHED_PX,
            padding=PADDING,
        )

    def show(self, moments: Sequence[Moment], family: str) -> None:
        """The last seconds, in the unit of that family."""
        if family != self._family:
            self._family, self._plot.axes = family, _axes(_label(family))
        self._plot.data = _with_limits(reached_series(moments, family), family)


class ProbabilityPlot:
    """How sure the module is of the base task: of the family, and whether its target is ahead of zero or behind."""

    def __init__(self, gui: viser.GuiApi, families: Sequence[str]):
        self._base_tasks = [(family, sign) for family in families for sign in (1, -1)]
        lines: list[uplot.Series] = [
            {
                "label": f"{family} {'+' if sign > 0 else '-'}",
                "stroke": family_named(family).colour,
                "width": 2,
                "dash": () if sign > 0 else BEHIND,
                "points": {"show": False},
            }
            for family, sign in self._base_tasks
        ]
        self._plot = gui.add_uplot(
            data=probability_series([], self._base_tasks),
            series=({}, *lines),
            scales={"x": {"time": False}, "y": {"range": (-0.05, 1.05)}},
            axes=_axes("probability"),
            legend={"show": False},
            height=PROBABILITY_PX,
            padding=PADDING,
        )

    def show(self, moments: Sequence[Moment]) -> None:
        """The last seconds."""
        self._plot.data = probability_series(moments, self._base_tasks)

    def remove(self) -> None:
        """Another module may know other families."""
        self._plot.remove()


def _label(family: str) -> str:
    """What a family is about."""
    quantity = family_named(family).quantity
    return f"{quantity.label} [{quantity.unit}]"


def _dots(colour: str) -> uplot.Series_Points:
    return {"show": True, "size": 3.5, "width": 0, "fill": colour}


def _with_limits(series: Series, family: str) -> Series:
    """And a last one, not to be seen, whose values are the axis' ends by turns.

    uPlot cannot find the ends by itself where values are missing, and would draw a chart anew to be told them. First
    guesses of the belief may lie anywhere: they do not count.
    """
    time, robot, hidden, _ = series
    return *series, np.resize(limits([robot, hidden], family), len(time))


def _axes(label: str) -> tuple[uplot.Axis, uplot.Axis]:
    text: uplot.Axis = {"font": FONT, "labelFont": FONT, "labelGap": 0, "labelSize": 15, "gap": 2}
    text["ticks"] = {"size": 4, "width": 1}
    text["grid"] = {"width": 1}
    return {**text, "label": "time [s]", "size": 18}, {**text, "label": label, "size": 34}
