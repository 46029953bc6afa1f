"""Quantities: where they stand in a global state, and how two values differ."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rebody.tasks import FAMILIES, Quantity
from rebody.tasks.quantities import PITCH, VX, X
from rebody.types import GLOBAL_FIELDS, GlobalState

ANGLES = st.floats(-20, 20)


@settings(deadline=None)
@given(a=ANGLES, b=ANGLES, turns=st.integers(-3, 3))
def test_angles_differ_by_the_shorter_way_whatever_turn_they_are_in(a, b, turns):
    difference = PITCH.difference(a, b)
    assert abs(difference) <= np.pi + 1e-9
    assert np.cos(difference) == pytest.approx(np.cos(a - b), abs=1e-9)
    again = PITCH.difference(a + 2 * np.pi * turns, b)
    assert np.cos(again - difference) == pytest.approx(1.0, abs=1e-9)
    assert X.difference(a, b) == a - b


@given(a=st.floats(-1.5, 1.5), b=st.floats(-1.5, 1.5))
def test_what_needs_no_wrapping_keeps_its_last_bit(a, b):
    assert PITCH.difference(a, b) == a - b


def test_components_are_read_in_their_order_of_numpy_and_of_jax():
    state = GlobalState(**{name: np.full(3, i, np.float32) for i, name in enumerate(GLOBAL_FIELDS)})
    both = Quantity("both", ("vx", "x"), "m", "both")
    np.testing.assert_array_equal(both.read(state), np.tile([6.0, 0.0], (3, 1)))
    assert isinstance(both.read(state), np.ndarray)
    assert VX.read(state).shape == (3, 1)


def test_families_are_about_fields_of_the_global_state():
    for family in FAMILIES:
        assert set(family.quantity.components) <= set(GLOBAL_FIELDS)
