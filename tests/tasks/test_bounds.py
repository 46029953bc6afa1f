"""Bounds of what can be paid: nothing lies beyond them, and they are reached."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.tasks.conftest import LEAN, PLACE

from rebody.ranges import Box, interval
from rebody.tasks import LAWS, FamilySet, Payment
from rebody.tasks.bounds import payable
from rebody.tasks.line import GOAL, LINE
from rebody.types import Task, global_state

ENDS = st.floats(-20, 20)
PAYMENTS = {
    "summed": Payment("l1"),
    "relatively_summed": Payment("l1", relative=True),
    "saturated": Payment("gaussian", relative=True, width=0.5, scale=3.0, offset=1.0),
    "clipped": Payment("clipped", width=2.0, offset=1.0),
    "reached": Payment("sparse", width=2.0),
    "along": Payment("direction"),
    "relatively_along": Payment("direction", relative=True),
}
NAMES = ("plain", "relative", *PAYMENTS)


@pytest.fixture(scope="module", autouse=True)
def _known():
    """Laws of other measures and forms, as files of one's own may have them."""
    with pytest.MonkeyPatch.context() as patch:
        for name, payment in PAYMENTS.items():
            patch.setitem(LAWS, name, payment.law)
        yield


def paid(family, targets, value):
    """Rewards of these targets [target, size], of a body whose quantity has this value [size]."""
    families, count = FamilySet((family,)), len(targets)
    told = dict(zip(family.quantity.components, value, strict=True))
    state = global_state(**{name: np.full(count, number, np.float32) for name, number in told.items()})
    return np.asarray(families.reward(Task(np.zeros(count, int), np.asarray(targets, np.float32)), state))


def assert_none_lies_beyond(family, ends, low, high, shares, targets):
    """Of targets within a range, and of a body anywhere between two ends; `payable` for any target holds as well."""
    ends, low, high = np.array(ends), np.array(low), np.array(high)
    pay = paid(family, targets, ends[0] + np.array(shares) * (ends[1] - ends[0]))
    for bounds in (payable(family, tuple(ends), Box(tuple(low), tuple(high))), payable(family, tuple(ends))):
        assert pay.min() >= bounds[0] - 1e-4 * (1 - bounds[0])
        assert pay.max() <= bounds[1] + 1e-4


@pytest.mark.parametrize("family", LINE.names)
@pytest.mark.parametrize("law", NAMES)
@settings(deadline=None)
@given(ends=st.tuples(ENDS, ENDS), ranges=st.tuples(ENDS, ENDS), share=st.floats(0, 1))
def test_no_target_of_a_range_pays_more_or_less(family, law, ends, ranges, share):
    low, high = sorted(ranges)
    family = replace(LINE.named(family), law=law)
    targets = np.linspace(low, high, 201)[:, None]
    assert_none_lies_beyond(family, [[ends[0]], [ends[1]]], [low], [high], [share], targets)


TWO = st.tuples(ENDS, ENDS)
SHARES = st.tuples(st.floats(0, 1), st.floats(0, 1))


@pytest.mark.parametrize("family", [PLACE, LEAN], ids=lambda family: family.name)
@pytest.mark.parametrize("law", NAMES)
@settings(deadline=None)
@given(first=TWO, second=TWO, one=TWO, other=TWO, shares=SHARES)
def test_no_vector_of_a_range_pays_more_or_less(family, law, first, second, one, other, shares):
    low, high = np.minimum(one, other), np.maximum(one, other)
    axes = [np.linspace(*ends, 15) for ends in zip(low, high, strict=True)]
    targets = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    assert_none_lies_beyond(replace(family, law=law), [first, second], low, high, shares, targets)


@pytest.mark.parametrize(
    ("law", "moved", "targets", "bounds"),
    [
        ("plain", (1.0, 1.0), (-10.0, 10.0), (-11.0, 0.0)),
        ("plain", (12.0, 13.0), (-10.0, 10.0), (-23.0, -2.0)),
        ("relative", (0.0, 0.0), (2.0, 15.0), (-1.0, -1.0)),  # whoever stands at the start is paid -1
        ("relative", (3.0, 3.0), (-15.0, 15.0), (-4.0, 0.0)),  # worst: a goal at -1, whose floor is 1 m
        ("saturated", (3.0, 3.0), (3.0, 6.0), (1 + 3 * np.exp(-1.0), 4.0)),
        ("clipped", (3.0, 3.0), (4.0, 6.0), (-1.0, 0.0)),
        ("reached", (3.0, 3.0), (6.0, 8.0), (0.0, 0.0)),
        ("along", (1.0, 3.0), (-15.0, 15.0), (-3.0, 3.0)),
        ("relatively_along", (1.0, 3.0), (2.0, 15.0), (-1.5, 1.5)),
    ],
)
def test_known_bounds_of_goals(law, moved, targets, bounds):
    ends = tuple(np.array([end]) for end in moved)
    assert payable(replace(GOAL, law=law), ends, interval(*targets)) == pytest.approx(bounds)


@pytest.mark.parametrize(
    ("law", "moved", "targets", "bounds"),
    [
        ("plain", ((0.0, 0.0), (0.0, 0.0)), Box((-3.0, -4.0), (3.0, 4.0)), (-5.0, 0.0)),
        ("plain", ((6.0, 8.0), (6.0, 8.0)), Box((0.0, 0.0), (3.0, 4.0)), (-10.0, -5.0)),
        ("relative", ((0.0, 0.0), (0.0, 0.0)), Box((3.0, 4.0), (6.0, 8.0)), (-1.0, -1.0)),
        ("summed", ((0.0, 0.0), (0.0, 0.0)), Box((-3.0, -4.0), (3.0, 4.0)), (-5.0 * 2**0.5, 0.0)),
        ("along", ((3.0, 4.0), (3.0, 4.0)), Box((-6.0, -8.0), (6.0, 8.0)), (-5.0, 5.0)),
    ],
)
def test_known_bounds_of_places(law, moved, targets, bounds):
    ends = tuple(np.array(end) for end in moved)
    assert payable(replace(PLACE, law=law), ends, targets) == pytest.approx(bounds, abs=1e-5)


def test_any_target_of_a_relative_reward():
    still = np.array([3.0])
    assert payable(GOAL, (still, still)) == pytest.approx((-4.0, 0.0))
