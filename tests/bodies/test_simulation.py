"""What every simulation promises: robots in the plane and in space, and point masses."""

import copy
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rebody.bodies import PointMasses, RobotBatch, load_robot
from rebody.bodies.toys import FullToy, MassDamper, PositionToy
from rebody.types import GLOBAL_FIELDS

ANT = load_robot(str(Path(__file__).parents[2] / "examples" / "ant" / "ant.toml"))
MADE = {
    "mass-damper": lambda: PointMasses(MassDamper(), 3),
    "full toy": lambda: PointMasses(FullToy(), 3),
    "position toy": lambda: PointMasses(PositionToy(), 3),
    "hopper": lambda: RobotBatch(load_robot("hopper"), 3, threads=1),
    "ant": lambda: RobotBatch(ANT, 3, threads=1),
    "ant in space": lambda: RobotBatch(replace(ANT, space="free"), 3, threads=1),
}
TWO = np.array([True, False, True])


@pytest.fixture(params=MADE)
def body(request):
    body = MADE[request.param]()
    body.reset(np.random.default_rng(0))
    return body


def seen(body):
    return body.observe().select(GLOBAL_FIELDS)


def act(body, steps, seed=0):
    """At random; what is seen after each step."""
    actions = np.random.default_rng(seed).uniform(-1, 1, (steps, body.size, body.actions)).astype(np.float32)
    states = []
    for action in actions:
        body.step(action)
        states.append(seen(body))
    return np.array(states)


def test_velocity_is_displacement_over_the_last_decision(body):
    """At every step, also between decisions; before the first it stood still."""
    x = [np.zeros((3, 2)), *act(body, 3 * body.steps_per_decision)[..., :2]]  # x and y
    assert np.abs(np.diff(x, axis=0)).max() > 0
    velocity = seen(body)[:, GLOBAL_FIELDS.index("vx") :][:, :2]
    np.testing.assert_allclose(velocity, (x[-1] - x[-1 - body.steps_per_decision]) / 0.1, atol=1e-4)


def test_a_reset_of_some_leaves_the_others_and_forgets(body):
    act(body, body.steps_per_decision + 1)
    before = body.state
    body.reset(np.random.default_rng(1), TWO)
    np.testing.assert_array_equal(body.state[1], before[1])
    assert not seen(body)[TWO][:, 6:].any()
    np.testing.assert_allclose(body.pose()[TWO][:, :2], 0.0)


def test_a_state_continues_to_the_last_bit_in_another_and_in_copies(body):
    act(body, body.steps_per_decision + 1)
    twins = [copy.deepcopy(body), pickle.loads(pickle.dumps(body)), copy.deepcopy(body)]
    act(twins[2], 4, seed=5)
    twins[2].state = body.state
    expected = act(body, 4, seed=2)
    for twin in twins:
        np.testing.assert_array_equal(act(twin, 4, seed=2), expected)
        np.testing.assert_array_equal(twin.proprioception(), body.proprioception())


def test_placed_it_stands_as_it_did(body):
    act(body, body.steps_per_decision)
    before, joints = body.pose(), body.joint_state()
    body.place(np.array([4.0, -2.0]), who=TWO)
    np.testing.assert_allclose(body.pose()[:, 0], [4.0, before[1, 0], -2.0], atol=1e-6)
    np.testing.assert_allclose(body.pose()[:, 1:], before[:, 1:], atol=1e-6)
    np.testing.assert_allclose(body.joint_state(), joints, atol=1e-6)


def test_a_push_changes_what_is_shown_of_the_velocity(body):
    def shown():
        return body.observation()[:, body.model.nq :]

    before = shown()
    body.push(np.array([0.5, 0.0, -0.5]))
    np.testing.assert_allclose(shown() - before, np.outer([0.5, 0, -0.5], np.eye(body.model.nv)[0]), atol=1e-6)
    before = shown()
    body.push(np.array([[0.0, 0.5]] * 3))  # only what moves in space minds
    free = "vy" in getattr(getattr(body, "spec", None), "moving_fields", ())
    moved = np.flatnonzero(np.abs(shown() - before).max(axis=0) > 1e-6)
    assert moved.tolist() == ([1] if free else [])


def test_pose_and_picture_are_those_of_the_state(body):
    act(body, body.steps_per_decision)
    np.testing.assert_allclose(body.pose(), seen(body)[:, :6], atol=1e-6)
    np.testing.assert_array_equal(body.picture_pose(), body.observation()[:, : body.model.nq])
    body.picture_pose()[:] = 99.0  # a copy
    assert not body.fallen.any()
    assert np.abs(body.pose()).max() < 9
