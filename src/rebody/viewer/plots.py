"""The plots over time: target against reached value, and the probabilities of the base tasks."""

from collections.abc import Sequence

import numpy as np
import viser
from jaxtyping import Float
from viser import uplot

from rebody.tasks import Family, FamilySet
from rebody.types import DECISION_DT
from rebody.viewer import colours
from rebody.viewer.session import REMEMBERED_S, Moment

Series = tuple[Float[np.ndarray, " time"], ...]
FONT = "11px system-ui, sans-serif"
REACHED_PX, PROBABILITY_PX, PADDING = 135, 88, (6, 12, 0, 0)
DASHES = ((), (3, 3), (8, 3), (1, 3))
"""Of lines that are about a family's last direction, the one before and so on, by turns [pixels]."""
HIDE: uplot.Series_Points = {"show": False}
LOOSE: uplot.Series = {"auto": False}
"""Has no say in where its axis ends."""


def reached_series(moments: Sequence[Moment], family: Family, axes: int = 1) -> Series:
    """Time [s]; then of each of so many axes the robot's value, the hidden target and the believed one, in the
    family's unit.

    NaN where there is none: a target of another family, a time that is still to come. Only the last stretch of a
    hidden family is shown, so that a line has no gaps.
    """
    elsewhere = [i for i, moment in enumerate(moments) if moment.task.family != family.name]
    begins, nothing = elsewhere[-1] + 1 if elsewhere else 0, (np.nan,) * axes
    robot = [moment.reached[family.name] for moment in moments]
    hidden = [moment.task.target if i >= begins else () for i, moment in enumerate(moments)]
    believed = [moment.reading.target if moment.reading.family == family.name else () for moment in moments]
    of_each = [[(*vector, *nothing)[i] for vector in of] for i in range(axes) for of in (robot, hidden, believed)]
    return _on_one_axis(moments, of_each)


def limits(values: Sequence[Float[np.ndarray, " time"]], family: Family) -> tuple[float, float]:
    """Ends of an axis, around 0 and all values."""
    shown = np.append(np.concatenate(values), 0.0)
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    margin = 0.1 * max(high - low, family.floor)
    return low - margin, high + margin


def probability_series(moments: Sequence[Moment], base_tasks: Sequence[tuple[str, str]]) -> Series:
    """Time [s], and the probability of each base task."""
    return _on_one_axis(moments, [[m.reading.base_tasks[each] for m in moments] for each in base_tasks])


def _on_one_axis(moments: Sequence[Moment], values: list[list[float]]) -> Series:
    """Of full length from the start on, so that the axis moves only when it must."""
    length = round(REMEMBERED_S / DECISION_DT)
    first = moments[0].time_s if moments else DECISION_DT
    empty = [np.nan] * (length - len(moments))
    return first + DECISION_DT * np.arange(length), *(np.array([*each, *empty], float) for each in values)


class ReachedPlot:
    """What the robot reaches, what is hidden, what is believed: a line per component of a target, paler and paler."""

    def __init__(self, gui: viser.GuiApi, families: FamilySet):
        self._family, self._size = families[0], families.size
        self._plot = gui.add_uplot(
            data=self._data([]),
            series=({}, *(line for i in range(self._size) for line in _lines(i)), {"width": 0, "points": HIDE}),
            scales={"x": {"time": False}},
            axes=_axes(_label(self._family)),
            legend={"show": False},
            height=REACHED_PX,
            padding=PADDING,
        )

    def show(self, moments: Sequence[Moment], family: Family) -> None:
        """The last seconds, in the unit of that family."""
        if family != self._family:
            self._family, self._plot.axes = family, _axes(_label(family))
        self._plot.data = self._data(moments)

    def remove(self) -> None:
        """Another module may know other families."""
        self._plot.remove()

    def _data(self, moments: Sequence[Moment]) -> Series:
        return _with_limits(reached_series(moments, self._family, self._size), self._family)


class ProbabilityPlot:
    """How sure the module is of the base task: of the family, and of the direction of its target."""

    def __init__(self, gui: viser.GuiApi, families: FamilySet):
        directions = [(family, i) for family in families for i in range(len(family.direction_names))]
        self._base_tasks = [(family.name, family.direction_names[::-1][i]) for family, i in directions]
        lines: list[uplot.Series] = [
            {
                "label": f"{family.name} {family.direction_names[::-1][i]}",
                "stroke": family.colour,
                "width": 2,
                "dash": DASHES[i % len(DASHES)],
                "points": HIDE,
            }
            for family, i in directions
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


def _lines(i: int) -> tuple[uplot.Series, uplot.Series, uplot.Series]:
    """Of one component: the robot's, the hidden and the believed value."""
    hidden, robot, believed = (colours.shade(c, i) for c in (colours.HIDDEN, colours.ROBOT, colours.BELIEVED))
    return (
        {**LOOSE, "label": "robot", "stroke": robot, "width": 2, "points": HIDE},
        {**LOOSE, "label": "hidden", "stroke": hidden, "width": 1.5, "dash": (6, 4), "points": HIDE},
        {**LOOSE, "label": "believed", "width": 0, "points": _dots(believed)},  # dots, since a belief jumps
    )


def _label(family: Family) -> str:
    """What a family is about."""
    names = f"{', '.join(family.quantity.components)} (paler)"
    return f"{family.quantity.label if family.size == 1 else names} [{family.unit}]"


def _dots(colour: str) -> uplot.Series_Points:
    return {"show": True, "size": 3.5, "width": 0, "fill": colour}


def _with_limits(series: Series, family: Family) -> Series:
    """And a last one, not to be seen, whose values are the axis' ends by turns.

    uPlot cannot find the ends by itself where values are missing, and would draw a chart anew to be told them. First
    guesses of the belief may lie anywhere: they do not count.
    """
    time, *lines = series
    return *series, np.resize(limits([*lines[0::3], *lines[1::3]], family), len(time))


def _axes(label: str) -> tuple[uplot.Axis, uplot.Axis]:
    text: uplot.Axis = {"font": FONT, "labelFont": FONT, "labelGap": 0, "labelSize": 15, "gap": 2}
    text["ticks"] = {"size": 4, "width": 1}
    text["grid"] = {"width": 1}
    return {**text, "label": "time [s]", "size": 18}, {**text, "label": label, "size": 34}
