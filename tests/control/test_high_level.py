"""What the policies of the toy and the flat policy of a robot are shown."""

import jax
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rebody.control.flat import FlatView
from rebody.control.high_level import PolicyView
from rebody.control.places import FARTHEST, Place, TaskCode, lengths, numbers_of, owners, places_of, seen_from
from rebody.ranges import Box, interval
from rebody.tasks import Family, FamilySet, Quantity
from rebody.tasks.line import GOAL, VELOCITY
from rebody.types import GLOBAL_FIELDS, POSE_FIELDS, Belief, GlobalState, Task, global_state

X, VX = GOAL.quantity, VELOCITY.quantity
FAMILIES = FamilySet((GOAL.within(interval(-10.0, 2.0)), VELOCITY.within(interval(-3.0, 1.0))))
OF_GOAL, OF_VELOCITY = 0, 1
CODE = TaskCode(places_of(FAMILIES))
BELIEF = Belief(np.array([0.5, -1.0], np.float32), np.array([0.25, 4.0], np.float32))
DOCK = Family(
    name="dock",
    quantity=Quantity("xyyaw", ("x", "y", "yaw"), "m, rad", "place and heading"),
    targets=(Box((-5.0, -2.0, -3.0), (1.0, 4.0, 3.0)),),
    floor=0.5,
    tolerance=0.3,
)
VECTORS = FamilySet((VELOCITY, DOCK))


def vector(*numbers):
    return np.array(numbers, np.float32)


def test_a_task_is_a_one_hot_and_the_same_times_its_scaled_target():
    told = CODE(Task(np.array([OF_GOAL, OF_VELOCITY, OF_GOAL]), np.array([[-5.0], [1.5], [0.0]], np.float32)))
    np.testing.assert_allclose(told.mean, [[1, 0, -0.5, 0], [0, 1, 0, 0.5], [1, 0, 0, 0]], rtol=1e-6)
    np.testing.assert_array_equal(told.variance, np.zeros((3, 4)))
    np.testing.assert_allclose(told.features()[0], [1, 0, -0.5, 0, 0, 0, 0, 0], rtol=1e-6)


def test_a_task_of_several_numbers_has_as_many_places():
    told = TaskCode(places_of(VECTORS))(Task(np.array([0, 1]), np.array([[1.5, 0, 0], [5.0, -2.0, 1.5]], np.float32)))
    np.testing.assert_allclose(told.mean, [[1, 0, 0.5, 0, 0, 0], [0, 1, 0, 1.0, -0.5, 0.5]], rtol=1e-6)
    np.testing.assert_array_equal(told.variance, np.zeros((2, 6)))


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_any_batch_shape(shape):
    told = CODE(Task(np.full(shape, OF_VELOCITY), np.full((*shape, 1), -3.0, np.float32)))
    np.testing.assert_array_equal(told.mean, np.broadcast_to([0, 1, 0, -1], (*shape, 4)))


def test_targets_are_divided_by_the_largest_of_their_family():
    assert CODE.places == (Place(X, (10.0,)), Place(VX, (3.0,)))
    both = places_of(FAMILIES.only(("velocity", "goal")).beside(VECTORS))
    assert [place.scales for place in both] == [(3.0,), (10.0,), (5.0, 4.0, 3.0)]  # in the order of the families
    np.testing.assert_allclose(CODE(Task(np.array(OF_GOAL), vector(-15.0))).mean, [1, 0, -1.5, 0])


def test_whose_numbers_are_whose():
    places = places_of(VECTORS)
    assert numbers_of(places) == 4
    np.testing.assert_array_equal(owners(places), [0, 1, 1, 1])
    np.testing.assert_allclose(lengths(places, vector(-2.0, 2.0, 3.0, 6.0)), [2.0, 7.0], rtol=1e-6)


def test_a_policy_sees_scaled_fields_then_mean_and_deviation():
    state = GlobalState(**{name: np.asarray(i, np.float32) for i, name in enumerate(GLOBAL_FIELDS)})
    np.testing.assert_allclose(PolicyView(("vx", "x"), (2.0, 7.0))(state, BELIEF), [3.0, 0.0, 0.5, -1.0, 0.5, 2.0])


def test_places_are_seen_from_where_the_body_is():
    """Two fields, the second likelier: its place as it is, the first's faded by how much less likely it is."""
    state = global_state(x=np.asarray(6.0, np.float32), vx=np.asarray(-1.0, np.float32))
    belief = Belief(vector(0.2, 0.8, -0.4, 0.5), vector(0.0, 0.0, 0.04, 0.01))
    view = PolicyView(("vx",), (2.0,), (Place(X, (10.0,)), Place(VX, (2.0,))))
    seen = view(state, belief)
    faded = np.array([0.25, 1.0])
    expected = [[-0.5], [0.2, 0.8], faded * [-1.0, 1.0], faded * [0.4, 0.5], faded * [0.2, 0.1]]
    np.testing.assert_allclose(seen, np.concatenate(expected), rtol=1e-5)
    assert len(seen) == view.size(4)


def test_vectors_are_seen_from_where_the_body_is():
    """One length for each place, all else for each number."""
    places = (Place(VX, (2.0,)), Place(DOCK.quantity, (10.0, 10.0, np.pi)))
    told = {"vx": -1.0, "x": 5.0, "y": 1.0, "yaw": -0.9 * np.pi}
    state = global_state(**{name: np.asarray(value, np.float32) for name, value in told.items()})
    belief = Belief(vector(0.2, 0.8, -0.4, 0.2, 0.1, 0.9), vector(0.0, 0.0, 0.04, 0.01, 0.0, 0.09))
    seen = PolicyView(("vx",), (2.0,), places)(state, belief)
    faded = np.array([0.25, 1.0])
    ahead = np.array([0.25 * 0.1, -0.3, 0.0, -0.2])  # the heading by the shorter way round
    far = faded * [0.4, np.sqrt(0.04 + 0.01 + 0.81)]
    doubt = [0.25 * 0.2, 0.1, 0.0, 0.3]
    np.testing.assert_allclose(seen, np.concatenate([[-0.5], [0.2, 0.8], ahead, far, doubt]), rtol=1e-4, atol=1e-6)
    assert len(seen) == PolicyView(("vx",), (2.0,), places).size(6)


ANGLE = st.floats(-3.1, 3.1)
PLACE = st.floats(-9.0, 9.0)


@settings(deadline=None)
@given(here=st.tuples(PLACE, PLACE, ANGLE), there=st.tuples(PLACE, PLACE, ANGLE), turns=st.integers(-2, 2))
def test_what_is_ahead_knows_no_turns(here, there, turns):
    places = places_of(VECTORS)
    scales = np.array(places[1].scales, np.float32)

    def ahead(here):
        state = global_state(**{name: here[i : i + 1].reshape(()) for i, name in enumerate(DOCK.quantity.components)})
        told = TaskCode(places)(Task(np.array(1), vector(*there)))
        return np.asarray(seen_from(places, [place.here(state) for place in places], told))[3:6]

    seen = ahead(vector(*here))
    np.testing.assert_allclose(ahead(vector(*here[:2], here[2] + 2 * np.pi * turns)), seen, atol=1e-5)
    left = (np.array(there) - here) / scales
    np.testing.assert_allclose(seen[:2], np.clip(left[:2], -FARTHEST, FARTHEST), atol=1e-5)
    assert np.cos(scales[2] * seen[2]) == pytest.approx(np.cos(there[2] - here[2]), abs=1e-5)
    assert abs(scales[2] * seen[2]) <= np.pi + 1e-5


def test_far_from_home_and_near_it_are_the_same_and_farther_than_far_too():
    def seen(x, goal):
        state = global_state(x=np.asarray(x, np.float32), vx=np.asarray(1.0, np.float32))
        told = CODE(Task(np.array(OF_GOAL), vector(goal)))
        return np.asarray(PolicyView(("vx",), (3.0,), CODE.places)(state, told))

    size = 5  # where the magnitude of the goal itself stands: a relative reward depends on it
    np.testing.assert_allclose(seen(40.0, 35.0)[:size], seen(2.0, -3.0)[:size], rtol=1e-5)
    np.testing.assert_array_equal(seen(60.0, 10.0), seen(45.0, 10.0))


def pose_of(**fields):
    return vector(*(fields.get(name, 0.0) for name in POSE_FIELDS))


def test_a_flat_policy_sees_joints_then_x_then_the_belief():
    joints = np.array([0.1, -0.2], np.float32)
    for pose in (pose_of(x=-5.0), pose_of(x=-5.0, y=3.0, pitch=0.7, yaw=2.0)):
        seen = FlatView(reach=10.0)(joints, pose, BELIEF)
        np.testing.assert_allclose(seen, [0.1, -0.2, -0.5, 0.5, -1.0, 0.5, 2.0])
    assert FlatView(reach=10.0).size(2, 2) == 7


def test_a_flat_policy_sees_places_of_the_floor_from_where_it_is():
    """A speed as it is told: what the body does itself its joint state says."""
    view, joints = FlatView(places_of(VECTORS)), np.array([0.1, -0.2], np.float32)
    told = TaskCode(view.places)(Task(np.array(1), vector(2.5, -2.0, 1.5)))
    seen = view(joints, pose_of(x=-2.5, y=2.0, yaw=-1.5, pitch=1.0), told)
    far = np.sqrt(0.25 + 0.25 + 0.25)
    expected = [0.1, -0.2, 0, 1, 0, 1.0, -1.0, 1.0, 0, far, 0, 0, 0, 0]
    np.testing.assert_allclose(seen, expected, rtol=1e-4, atol=1e-6)
    assert len(seen) == view.size(2, 6)
    fast = TaskCode(view.places)(Task(np.array(0), vector(1.5, 0.0, 0.0)))
    np.testing.assert_allclose(view(joints, pose_of(x=9.0), fast)[4], 0.5, rtol=1e-6)


def test_all_that_is_seen_may_be_compiled():
    view = PolicyView(("vx",), (3.0,), places_of(VECTORS))
    state = GlobalState(**{name: np.full(5, 0.1 * i, np.float32) for i, name in enumerate(GLOBAL_FIELDS)})
    told = TaskCode(view.places)(Task(np.array([0, 1, 0, 1, 1]), np.ones((5, 3), np.float32)))
    np.testing.assert_allclose(jax.jit(view.__call__)(state, told), view(state, told), rtol=1e-5)
