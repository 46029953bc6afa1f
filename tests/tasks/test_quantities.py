"""Quantities: where they stand in a global state, and how two values differ."""

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.tasks.conftest import LEAN

from rebody.tasks import SHIPPED, FamilySet, Quantity
from rebody.tasks.line import GOAL, STAND, VELOCITY
from rebody.types import ANGLES, GLOBAL_FIELDS, GlobalState, Task, global_state

PITCH, X, VX = (family.quantity for family in (STAND, GOAL, VELOCITY))
POSE = Quantity("pose", ("x", "yaw", "pitch"), "m, rad", "pose")
ANGLE = st.floats(-20, 20)
THREE = st.tuples(ANGLE, ANGLE, ANGLE)


@settings(deadline=None)
@given(a=ANGLE, b=ANGLE, turns=st.integers(-3, 3))
def test_angles_differ_by_the_shorter_way_whatever_turn_they_are_in(a, b, turns):
    difference = PITCH.difference(np.array([a]), np.array([b]))
    assert abs(difference) <= np.pi + 1e-9
    assert np.cos(difference) == pytest.approx(np.cos(a - b), abs=1e-9)
    again = PITCH.difference(np.array([a + 2 * np.pi * turns]), np.array([b]))
    assert np.cos(again - difference) == pytest.approx(1.0, abs=1e-9)
    assert X.difference(np.array([a]), np.array([b])) == a - b


@settings(deadline=None)
@given(a=THREE, b=THREE, turns=st.tuples(st.just(0), st.integers(-3, 3), st.integers(-3, 3)))
def test_each_angle_of_a_vector_wraps_and_nothing_else(a, b, turns):
    a, b, turned = np.array(a), np.array(b), np.array(a) + 2 * np.pi * np.array(turns)
    for one in (a, turned):
        difference = POSE.difference(one, b)
        assert difference[0] == a[0] - b[0]
        assert (np.abs(difference[1:]) <= np.pi + 1e-9).all()
        np.testing.assert_allclose(np.exp(1j * difference[1:]), np.exp(1j * (a - b)[1:]), atol=1e-9)
    assert POSE.distance(turned, b) == pytest.approx(POSE.distance(a, b), abs=1e-6)
    of_jax = POSE.difference(jnp.asarray(a, jnp.float32), jnp.asarray(b, jnp.float32))
    np.testing.assert_allclose(np.exp(1j * of_jax), np.exp(1j * POSE.difference(a, b)), atol=1e-4)


@settings(deadline=None)
@given(a=st.tuples(ANGLE, ANGLE), b=st.tuples(ANGLE, ANGLE))
def test_families_of_a_set_differ_as_they_do_alone(a, b):
    """Padded, and beside others that wrap elsewhere."""
    families = FamilySet((GOAL, LEAN, STAND))
    a, b = np.array(a, np.float32), np.array(b, np.float32)
    for i, family in enumerate(families):
        one, other = (families.pad(vector[: family.size]) for vector in (a, b))
        found = np.asarray(families.difference(np.asarray(i), one, other))
        alone = family.quantity.difference(one[: family.size], other[: family.size])
        np.testing.assert_allclose(found[: family.size], alone, atol=1e-5)
        assert not found[family.size :].any()


@settings(deadline=None)
@given(x=ANGLE, yaw=st.floats(-3.1, 3.1), target=st.tuples(ANGLE, ANGLE), turns=st.integers(-3, 3))
def test_an_error_knows_no_turns(x, yaw, target, turns):
    families, place = FamilySet((LEAN,)), np.array(target, np.float32)
    state = global_state(x=np.float32(x)[None], yaw=np.float32(yaw)[None])
    tasks = (Task(np.zeros(1, int), (place + np.array([0, 2 * np.pi * n])).astype("f4")[None]) for n in (0, turns))
    one, other = (families.error(task, state)[0] for task in tasks)
    assert one[0] == other[0]
    assert np.cos(one[1] - other[1]) == pytest.approx(1.0, abs=1e-6)
    assert abs(one[1]) <= np.pi + 1e-5


@given(a=st.floats(-1.5, 1.5), b=st.floats(-1.5, 1.5))
def test_what_needs_no_wrapping_keeps_its_last_bit(a, b):
    assert PITCH.difference(np.array([a]), np.array([b])) == a - b
    np.testing.assert_array_equal(POSE.difference(np.array([a, b, a]), np.array([b, a, a])), [a - b, b - a, 0.0])


def test_which_components_wrap():
    assert POSE.wraps == (False, True, True)
    assert (X.wraps, VX.wraps, PITCH.wraps) == ((False,), (False,), (True,))
    assert set(ANGLES) == {"roll", "pitch", "yaw"}
    assert Quantity("turn", ("yaw_rate",), "rad/s", "turn").wraps == (False,)


def test_a_distance_is_euclidean_and_exact_for_one_number():
    place = Quantity("xy", ("x", "y"), "m", "place")
    assert place.distance(np.array([[3.0, 0.0]]), np.array([[0.0, 4.0]])) == pytest.approx([5.0])
    assert X.distance(np.array([0.3]), np.array([0.1])) == abs(0.3 - 0.1)


def test_components_are_read_in_their_order_of_numpy_and_of_jax():
    state = GlobalState(**{name: np.full(3, i, np.float32) for i, name in enumerate(GLOBAL_FIELDS)})
    both = Quantity("both", ("vx", "x"), "m", "both")
    np.testing.assert_array_equal(both.read(state), np.tile([6.0, 0.0], (3, 1)))
    assert isinstance(both.read(state), np.ndarray)
    assert VX.read(state).shape == (3, 1)


@given(yaw=st.floats(-3.1, 3.1), vx=st.floats(-3, 3), vy=st.floats(-3, 3))
def test_speeds_in_the_frame_of_the_heading(yaw, vx, vy):
    """Turning the heading and the velocity alike changes nothing."""
    along = Quantity("along", ("vx", "vy", "vz"), "m/s", "along", frame="heading")
    velocity = (vx + 1j * vy) * np.exp(1j * yaw)
    state = global_state(yaw=np.array(yaw), vx=np.array(velocity.real), vy=np.array(velocity.imag), vz=np.array(1.0))
    np.testing.assert_allclose(along.read(state), [vx, vy, 1.0], atol=1e-9)


def test_families_are_about_fields_of_the_global_state():
    for family in SHIPPED:
        assert set(family.quantity.components) <= set(GLOBAL_FIELDS)
