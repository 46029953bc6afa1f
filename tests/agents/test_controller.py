"""What moves the joints looks at what it needs, and at nothing else."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.agents.controller import FlatController, TrackerController
from rebody.agents.rollout import joint_action
from rebody.bodies import RobotBatch
from rebody.control.tracker import Command
from rebody.tasks import GOAL, VELOCITY
from rebody.types import Belief, Subgoal

JOINTS = np.linspace(-1, 1, 34, dtype=np.float32).reshape(2, 17)
X = np.full(2, 3.0, np.float32)
LEVEL = np.zeros(2, np.float32)
SUBGOAL = Subgoal(np.array([GOAL, VELOCITY]), np.array([4.0, 2.0], np.float32))
BELIEF = Belief(np.array([[0.5, -1.0], [2.0, 0.3]], np.float32), np.array([[0.5, 0.1], [0.2, 1.0]], np.float32))
NOTHING = Subgoal(np.array([GOAL, GOAL]), np.full(2, np.nan, np.float32))


@pytest.fixture(scope="module")
def following(tracker):
    return TrackerController(tracker)


@pytest.fixture(scope="module")
def believing(flat_policy, inference):
    return FlatController(flat_policy, inference.parts.module.decoder)


def test_a_tracker_sees_the_pace_and_a_flat_policy_does_not(cheetah, following, believing):
    batch = RobotBatch(replace(cheetah, smoothing_s=0.2), 2)
    batch.push(np.array([1.0, -1.0]))
    batch.step(np.zeros((2, 6)))
    np.testing.assert_array_equal(following.see(batch)[:, :-1], believing.see(batch))
    np.testing.assert_allclose(following.see(batch)[:, -1], batch.pace, rtol=1e-6)
    assert np.abs(batch.pace).min() > 0.01


def test_the_tracker_is_told_the_distance(tracker, following):
    expected = tracker(JOINTS, Command(SUBGOAL.slot, np.array([1.0, 2.0], np.float32)))
    np.testing.assert_allclose(joint_action(following, JOINTS, X, LEVEL, SUBGOAL, None), expected, atol=1e-6)


def test_a_far_goal_is_shown_nearer_and_a_speed_as_it_is(tracker):
    expected = tracker(JOINTS, Command(SUBGOAL.slot, np.array([0.5, 2.0], np.float32)))
    cautious = TrackerController(tracker, goal_ahead=0.5)
    np.testing.assert_allclose(joint_action(cautious, JOINTS, X, LEVEL, SUBGOAL, None), expected, atol=1e-6)


def test_a_tracker_does_not_look_at_the_belief(following):
    action = joint_action(following, JOINTS, X, LEVEL, SUBGOAL, None)
    np.testing.assert_array_equal(joint_action(following, JOINTS, X, LEVEL, SUBGOAL, BELIEF), action)
    assert np.abs(joint_action(following, JOINTS, X + 1, LEVEL, SUBGOAL, None)[0] - action[0]).max() > 1e-3


def test_a_flat_policy_does_not_look_at_the_subgoal(believing):
    action = joint_action(believing, JOINTS, X, LEVEL, NOTHING, BELIEF)
    assert np.isfinite(action).all()
    np.testing.assert_array_equal(joint_action(believing, JOINTS, X, LEVEL, SUBGOAL, BELIEF), action)


def test_a_flat_policy_looks_at_joints_place_and_belief(flat_policy, believing):
    features = np.concatenate([JOINTS, X[:, None] / 10.0, BELIEF.mean, np.sqrt(BELIEF.variance)], axis=-1)
    action = joint_action(believing, JOINTS, X, LEVEL, NOTHING, BELIEF)
    np.testing.assert_allclose(action, flat_policy.actor(features), atol=1e-5)
    surer = Belief(BELIEF.mean, 0.1 * BELIEF.variance)
    for other in (
        joint_action(believing, JOINTS + 0.5, X, LEVEL, NOTHING, BELIEF),
        joint_action(believing, JOINTS, X + 5, LEVEL, NOTHING, BELIEF),
        joint_action(believing, JOINTS, X, LEVEL, NOTHING, Belief(BELIEF.mean + 1, BELIEF.variance)),
        joint_action(believing, JOINTS, X, LEVEL, NOTHING, surer),
    ):
        assert np.abs(other - action).max(axis=-1).min() > 1e-3
