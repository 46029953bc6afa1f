"""Bounds of what can be paid: nothing lies beyond them, and they are reached."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rebody.tasks import FAMILIES, reward
from rebody.tasks.bounds import payable
from rebody.types import GLOBAL_FIELDS, GlobalState, Task

ENDS = st.floats(-20, 20)


def paid(family: int, targets, quantity, form):
    """Rewards of these targets, of a body whose every number is `quantity`."""
    everywhere = np.full(np.shape(targets), quantity, np.float32)
    state = GlobalState(**dict.fromkeys(GLOBAL_FIELDS, everywhere))
    return np.asarray(reward(Task(np.full(np.shape(targets), family), np.asarray(targets, np.float32)), state, form))


@pytest.mark.parametrize("family", range(len(FAMILIES)))
@pytest.mark.parametrize("form", ["plain", "relative"])
@settings(deadline=None)
@given(ends=st.tuples(ENDS, ENDS), ranges=st.tuples(ENDS, ENDS), share=st.floats(0, 1))
def test_no_target_of_a_range_pays_more_or_less(family, form, ends, ranges, share):
    low, high = sorted(ranges)
    worst, best = payable(FAMILIES[family], form, ends, (low, high))
    pay = paid(family, np.linspace(low, high, 201), ends[0] + share * (ends[1] - ends[0]), form)
    assert pay.min() >= worst - 1e-4 * (1 - worst)
    assert pay.max() <= best + 1e-4


@pytest.mark.parametrize(
    ("form", "moved", "targets", "bounds"),
    [
        ("plain", (1.0, 1.0), (-10.0, 10.0), (-11.0, 0.0)),
        ("plain", (12.0, 13.0), (-10.0, 10.0), (-23.0, -2.0)),
        ("relative", (0.0, 0.0), (2.0, 15.0), (-1.0, -1.0)),  # whoever stands at the start is paid -1
        ("relative", (3.0, 3.0), (-15.0, 15.0), (-4.0, 0.0)),  # worst: a goal at -1, whose floor is 1 m
    ],
)
def test_known_bounds_of_goals(form, moved, targets, bounds):
    assert payable(FAMILIES[0], form, moved, targets) == pytest.approx(bounds)


def test_any_target_of_a_relative_reward():
    worst, best = payable(FAMILIES[0], "relative", (3.0, 3.0))
    assert (worst, best) == pytest.approx((-4.0, 0.0))
