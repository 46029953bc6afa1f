"""What the plots over time are given."""

import numpy as np
import pytest

from rebody.agents.belief import Reading
from rebody.ranges import Box
from rebody.tasks import SHIPPED, Family, Quantity
from rebody.tasks.task_file import TaskSpec
from rebody.types import Belief

pytest.importorskip("viser")
from rebody.viewer.plots import limits, probability_series, reached_series
from rebody.viewer.session import REMEMBERED_S, Moment

LENGTH = round(REMEMBERED_S / 0.1)


def moment(i: int, hidden: TaskSpec, believed: str) -> Moment:
    latent = Belief(np.zeros(2), np.ones(2))
    front = 0.7 if believed == "goal" else 0.2
    base_tasks = {("goal", "front"): front, ("goal", "back"): 1 - front}
    target = (10.0 + i, 20.0 + i) if believed == "place" else (10.0 + i,)
    reading = Reading(believed, target, np.eye(len(target)), base_tasks, {}, latent)
    reached = {"goal": (1.0 * i,), "velocity": (2.0 * i,), "stand": (0.0,), "place": (1.0 * i, 3.0 * i)}
    return Moment(0.1 * (i + 1), hidden, reached, -1.0, reading, (), None)


GOAL, RUN, GO = TaskSpec("goal", (4.0,)), TaskSpec("velocity", (1.5,)), TaskSpec("place", (1.0, -1.0))
PLACE = Family("place", Quantity("place", ("x", "y"), "m", "place"), (Box((-3.0, -3.0), (3.0, 3.0)),), 0.5, 0.3)
MOMENTS = [moment(0, RUN, "velocity"), moment(1, GOAL, "goal"), moment(2, RUN, "goal"), moment(3, RUN, "velocity")]


def test_targets_are_shown_in_the_unit_of_one_family():
    time, robot, hidden, believed = reached_series(MOMENTS, SHIPPED.named("velocity"))
    nan = np.nan
    np.testing.assert_allclose(time, 0.1 * np.arange(1, LENGTH + 1))
    np.testing.assert_array_equal(robot[:5], [0.0, 2.0, 4.0, 6.0, nan])
    np.testing.assert_array_equal(hidden[:5], [nan, nan, 1.5, 1.5, nan])  # the last stretch alone
    np.testing.assert_array_equal(believed[:5], [10.0, nan, nan, 13.0, nan])
    assert {len(series) for series in (time, robot, hidden, believed)} == {LENGTH}


def test_a_vector_has_three_lines_per_component_and_a_number_leaves_lines_free():
    moments = [moment(0, RUN, "place"), moment(1, GO, "velocity"), moment(2, GO, "place")]
    nan = np.nan
    x, y = np.split(np.array(reached_series(moments, PLACE, 2)[1:])[:, :3], 2)
    np.testing.assert_array_equal(x, [[0.0, 1.0, 2.0], [nan, 1.0, 1.0], [10.0, nan, 12.0]])
    np.testing.assert_array_equal(y, [[0.0, 3.0, 6.0], [nan, -1.0, -1.0], [20.0, nan, 22.0]])
    _, *lines = reached_series(moments, SHIPPED.named("velocity"), 2)
    assert [bool(np.isfinite(line).any()) for line in lines] == [True, False, True, False, False, False]


def test_probabilities_have_a_line_each():
    _, ahead, behind = probability_series(MOMENTS, [("goal", "front"), ("goal", "back")])
    np.testing.assert_array_equal(ahead[:4], [0.2, 0.7, 0.7, 0.2])
    np.testing.assert_allclose(ahead[:4] + behind[:4], 1.0)


def test_before_anything_happened_the_axes_are_there():
    time, *series = reached_series([], SHIPPED.named("goal"))
    assert time[0] == pytest.approx(0.1)
    assert np.isnan(series).all()
    assert limits(series, SHIPPED.named("goal")) == pytest.approx((-0.1, 0.1))


def test_an_axis_holds_zero_and_all_values():
    assert limits([np.array([2.0, np.nan]), np.array([4.0, 3.0])], SHIPPED.named("goal")) == pytest.approx((-0.4, 4.4))
