"""What the policies of the toy and the flat policy of a robot are shown."""

import numpy as np
import pytest

from rebody.agents.parts import task_code
from rebody.control.flat import FlatView
from rebody.control.high_level import PolicyView, TaskCode
from rebody.tasks import GOAL, VELOCITY
from rebody.types import GLOBAL_FIELDS, Belief, GlobalState, Task, global_state

CODE = TaskCode(((GOAL, 10.0), (VELOCITY, 3.0)))
BELIEF = Belief(np.array([0.5, -1.0], np.float32), np.array([0.25, 4.0], np.float32))


def test_a_task_is_a_one_hot_and_the_same_times_its_scaled_target():
    told = CODE(Task(np.array([GOAL, VELOCITY, GOAL]), np.array([-5.0, 1.5, 0.0], np.float32)))
    np.testing.assert_allclose(told.mean, [[1, 0, -0.5, 0], [0, 1, 0, 0.5], [1, 0, 0, 0]], rtol=1e-6)
    np.testing.assert_array_equal(told.variance, np.zeros((3, 4)))
    np.testing.assert_allclose(told.features()[0], [1, 0, -0.5, 0, 0, 0, 0, 0], rtol=1e-6)


@pytest.mark.parametrize("shape", [(), (4,), (2, 3)])
def test_any_batch_shape(shape):
    told = CODE(Task(np.full(shape, VELOCITY), np.full(shape, -3.0, np.float32)))
    np.testing.assert_array_equal(told.mean, np.broadcast_to([0, 1, 0, -1], (*shape, 4)))


def test_targets_are_divided_by_the_largest_of_their_family():
    assert task_code({"goal": (-2.0, 10.0)}).scales == ((GOAL, 10.0),)
    both = task_code({"velocity": (-3.0, 1.0), "goal": (2.0, 15.0)})
    assert both.scales == ((VELOCITY, 3.0), (GOAL, 15.0))  # in the order of the ranges
    np.testing.assert_allclose(both(Task(np.array(GOAL), np.array(-15.0, np.float32))).mean, [0, 1, 0, -1])


def test_a_policy_sees_scaled_fields_then_mean_and_deviation():
    state = GlobalState(**{name: np.asarray(i, np.float32) for i, name in enumerate(GLOBAL_FIELDS)})
    np.testing.assert_allclose(PolicyView(("vx", "x"), (2.0, 7.0))(state, BELIEF), [3.0, 0.0, 0.5, -1.0, 0.5, 2.0])


def test_places_are_seen_from_where_the_body_is():
    """Two fields, the second likelier: its place as it is, the first's faded by how much less likely it is."""
    state = global_state(x=np.asarray(6.0, np.float32), vx=np.asarray(-1.0, np.float32))
    belief = Belief(np.array([0.2, 0.8, -0.4, 0.5], "f4"), np.array([0.0, 0.0, 0.04, 0.01], "f4"))
    view = PolicyView(("vx",), (2.0,), (("x", 10.0), ("vx", 2.0)))
    seen = view(state, belief)
    faded = np.array([0.25, 1.0])
    expected = [[-0.5], [0.2, 0.8], faded * [-1.0, 1.0], faded * [0.4, 0.5], faded * [0.2, 0.1]]
    np.testing.assert_allclose(seen, np.concatenate(expected), rtol=1e-5)
    assert len(seen) == view.size(4)


def test_far_from_home_and_near_it_are_the_same_and_farther_than_far_too():
    def seen(x, goal):
        state = global_state(x=np.asarray(x, np.float32), vx=np.asarray(1.0, np.float32))
        told = CODE(Task(np.array(GOAL), np.asarray(goal, np.float32)))
        return np.asarray(PolicyView(("vx",), (3.0,), CODE.places)(state, told))

    size = 5  # where the magnitude of the goal itself stands: a relative reward depends on it
    np.testing.assert_allclose(seen(40.0, 35.0)[:size], seen(2.0, -3.0)[:size], rtol=1e-5)
    np.testing.assert_array_equal(seen(60.0, 10.0), seen(45.0, 10.0))


def test_a_flat_policy_sees_joints_then_x_then_the_belief():
    joints = np.array([0.1, -0.2], np.float32)
    np.testing.assert_allclose(
        FlatView(reach=10.0)(joints, np.asarray(-5.0, np.float32), BELIEF), [0.1, -0.2, -0.5, 0.5, -1.0, 0.5, 2.0]
    )
