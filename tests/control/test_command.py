"""Commands in the heading's frame: seen, moved past, and put back into the world."""

from dataclasses import replace

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rebody.control.command import (
    Command,
    Motion,
    absolute,
    addressed,
    after,
    commands_within,
    of_pose,
    of_rates,
    relative,
    slots_among,
)
from rebody.errors import RebodyError
from rebody.ranges import Box, interval
from rebody.tasks import SHIPPED, FamilySet, Quantity
from rebody.tasks.line import GOAL, LINE, STAND, VELOCITY
from rebody.types import POSE_FIELDS, Subgoal


def family(name, *components, frame="world"):
    """One that asks for these components of the global state."""
    size = len(components)
    quantity = Quantity(name, components, "m, rad", name, frame)
    return replace(GOAL, name=name, quantity=quantity, targets=(Box((-5.0,) * size, (5.0,) * size),), directions=())


FAMILIES = FamilySet(
    (
        family("place", "x", "y"),
        family("pose", "yaw", "y", "x"),
        family("run", "vx", "vy"),
        family("along", "vx", "vy", frame="heading"),
        family("heading", "yaw"),
        family("rise", "z", "pitch"),
        GOAL,
        VELOCITY,
    )
)
ALL = np.arange(len(FAMILIES))
NUMBER, ANGLE = st.floats(-9.0, 9.0), st.floats(-3.1, 3.1)
POSE = st.tuples(NUMBER, NUMBER, NUMBER, ANGLE, ANGLE, ANGLE)
VECTOR = st.tuples(NUMBER, ANGLE, ANGLE)


def everywhere(pose):
    return np.tile(np.array(pose, np.float32), (len(FAMILIES), 1))


def vectors(vector):
    """One for each family, zeros behind its size."""
    return np.stack([FAMILIES.pad(np.array(vector[: each.size], np.float32)) for each in FAMILIES])


def assert_same(found, expected):
    """Angles whatever turn they are in."""
    for i, each in enumerate(FAMILIES):
        difference = each.quantity.difference(*(np.asarray(of, float)[i, : each.size] for of in (found, expected)))
        np.testing.assert_allclose(difference, 0.0, atol=2e-5)
        assert not np.asarray(found)[i, each.size :].any()


@settings(deadline=None)
@given(vector=VECTOR, pose=POSE)
def test_what_is_seen_and_what_is_meant_are_inverse(vector, pose):
    subgoal, here = Subgoal(ALL, vectors(vector)), everywhere(pose)
    assert_same(absolute(FAMILIES, relative(FAMILIES, subgoal, here), here).value, subgoal.value)
    command = Command(ALL, vectors(vector))
    assert_same(relative(FAMILIES, absolute(FAMILIES, command, here), here).value, command.value)


def moved(before, then):
    """The motion between two poses, its displacement in the frame of the heading before."""
    change = np.array(then, float) - before
    across = (change[0] + 1j * change[1]) * np.exp(-1j * before[5])
    change[:2] = across.real, across.imag
    change[3:] = (change[3:] + np.pi) % (2 * np.pi) - np.pi
    change = everywhere(change)
    return Motion(change, everywhere(then), 10 * change, np.zeros(len(FAMILIES), bool))


@settings(deadline=None)
@given(vector=VECTOR, before=POSE, then=POSE, is_ahead=st.booleans())
def test_after_a_motion_it_is_seen_from_the_new_pose(vector, before, then, is_ahead):
    """x alone is that of the world, so a planar robot's: one that does not turn."""
    before = (*before[:5], 0.0) if is_ahead else before
    subgoal = Subgoal(ALL, vectors(vector))
    command = after(FAMILIES, relative(FAMILIES, subgoal, everywhere(before)), moved(before, then))
    expected = np.array(relative(FAMILIES, subgoal, everywhere(then)).value)
    if before[5]:
        expected[6:] = np.asarray(command.value)[6:]
    assert_same(command.value, expected)


compiled = jax.jit(lambda subgoal, here: relative(FAMILIES, subgoal, here))


@settings(deadline=None)
@given(vector=VECTOR, pose=POSE)
def test_numpy_and_jax_agree(vector, pose):
    subgoal, here = Subgoal(ALL, vectors(vector)), everywhere(pose)
    by_jax = compiled(subgoal, here)
    by_numpy = relative(FAMILIES, subgoal, here)
    assert isinstance(by_numpy.value, np.ndarray)
    assert_same(by_jax.value, by_numpy.value)


def test_by_hand():
    """A robot at (1, 2) that faces north."""
    here = everywhere((1.0, 2.0, 0.5, 0.0, 0.2, np.pi / 2))
    meant = [[1, 5, 0], [-np.pi / 2 - 3, 5, 1], [1, 0, 0], [1, 0, 0], [-3, 0, 0], [1.5, 0.1, 0], [4, 0, 0], [2, 0, 0]]
    seen = relative(FAMILIES, Subgoal(ALL, np.array(meant, np.float32)), here)
    expected = [
        [3, 0, 0],  # north is ahead
        [np.pi - 3, 3, 0],  # pairs of components that are not in order turn the other way
        [0, -1, 0],  # a speed to the east is to its right
        [1, 0, 0],  # one along its heading is so already
        [1.5 * np.pi - 3, 0, 0],  # round the shorter way
        [1, -0.1, 0],
        [3, 0, 0],  # x alone stays that of the world
        [2, 0, 0],
    ]
    found = np.asarray(seen.value)
    np.testing.assert_allclose(found[[0, 2, 3, 4, 5, 6, 7]], np.array(expected)[[0, 2, 3, 4, 5, 6, 7]], atol=1e-5)
    np.testing.assert_allclose(found[1, 1:], [0, 3], atol=1e-5)  # y, then x


def test_what_a_quantity_reads_of_a_pose_and_of_rates():
    numbers = np.arange(1.0, 7.0)  # x, y, z, roll, pitch, yaw
    read = {name: of_pose(FAMILIES.named(name), numbers).tolist() for name in ("pose", "run", "rise")}
    assert read == {"pose": [6, 2, 1], "run": [0, 0], "rise": [3, 5]}
    rates = {name: of_rates(FAMILIES.named(name), numbers).tolist() for name in ("pose", "run", "rise")}
    assert rates == {"pose": [6, 2, 1], "run": [1, 2], "rise": [3, 5]}
    assert POSE_FIELDS == ("x", "y", "z", "roll", "pitch", "yaw")


def test_subgoals_are_addressed_to_the_slots_of_a_tracker():
    in_play = FamilySet((VELOCITY, STAND, GOAL))
    slots = slots_among(in_play, FamilySet((GOAL, VELOCITY)))
    assert slots == (1, -1, 0)
    subgoal = Subgoal(np.array([2, 0, 1]), np.ones((3, 1), np.float32))
    np.testing.assert_array_equal(addressed(subgoal, slots).slot, [0, 1, -1])
    assert slots_among(LINE, LINE) == (0, 1, 2, 3)


def test_a_subgoal_of_a_longer_axis_is_cut_and_of_a_shorter_one_filled_up():
    """Families in play may be larger, or smaller, than what a tracker knows."""
    small, here = FamilySet((GOAL, VELOCITY)), np.zeros((2, 6), np.float32)
    wide = Subgoal(np.array([0, 1]), np.array([[3.0, 0.0, 0.0], [2.0, 0.0, 0.0]], np.float32))
    np.testing.assert_array_equal(relative(small, wide, here).value, [[3.0], [2.0]])
    narrow = Subgoal(np.array([6, 7]), np.array([[3.0], [2.0]], np.float32))
    np.testing.assert_array_equal(relative(FAMILIES, narrow, here).value, [[3.0, 0, 0], [2.0, 0, 0]])


def test_a_robots_reach_is_what_can_be_commanded():
    commands = commands_within((("velocity", interval(-1.0, 2.0)), ("goal", interval(-5.0, 5.0))), SHIPPED)
    assert commands.names == ("velocity", "goal")
    assert commands.ranges == {"velocity": interval(-1.0, 2.0), "goal": interval(-5.0, 5.0)}
    with pytest.raises(RebodyError, match="unknown family 'gaol'"):
        commands_within((("gaol", interval(-5.0, 5.0)),), SHIPPED)
