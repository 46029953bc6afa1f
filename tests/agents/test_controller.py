"""What moves the joints looks at what it needs, and at nothing else."""

from dataclasses import replace

import equinox as eqx
import jax
import numpy as np
import pytest

from rebody.agents.controller import FlatController, TrackerController
from rebody.agents.rollout import joint_action
from rebody.bodies import RobotBatch
from rebody.control.command import Command
from rebody.control.sac import Actor, SACConfig
from rebody.control.tracker import Tracker, command_inputs
from rebody.ranges import Box
from rebody.tasks import SHIPPED, FamilySet, Quantity, line
from rebody.types import POSE_FIELDS, Belief, Subgoal

JOINTS = np.linspace(-1, 1, 34, dtype=np.float32).reshape(2, 17)
GOAL, VELOCITY = 0, 1
"""Slots of the tiny tracker."""
SUBGOAL = Subgoal(np.array([GOAL, VELOCITY]), np.array([[4.0], [2.0]], np.float32))
BELIEF = Belief(np.array([[0.5, -1.0], [2.0, 0.3]], np.float32), np.array([[0.5, 0.1], [0.2, 1.0]], np.float32))
NOTHING = Subgoal(np.array([GOAL, GOAL]), np.full((2, 1), np.nan, np.float32))


def at(x):
    """Poses of two robots there [m]."""
    return np.full((2, 1), x, np.float32) * (np.array(POSE_FIELDS) == "x")


THERE = at(np.float32(3.0))


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
    expected = tracker(JOINTS, Command(SUBGOAL.slot, np.array([[1.0], [2.0]], np.float32)))
    np.testing.assert_allclose(joint_action(following, JOINTS, THERE, SUBGOAL, None), expected, atol=1e-6)


def test_a_far_goal_is_shown_nearer_and_a_speed_as_it_is(tracker):
    expected = tracker(JOINTS, Command(SUBGOAL.slot, np.array([[0.5], [2.0]], np.float32)))
    cautious = TrackerController(tracker, goal_ahead=0.5)
    np.testing.assert_allclose(joint_action(cautious, JOINTS, THERE, SUBGOAL, None), expected, atol=1e-6)


def test_a_tracker_does_not_look_at_the_belief(following):
    action = joint_action(following, JOINTS, THERE, SUBGOAL, None)
    np.testing.assert_array_equal(joint_action(following, JOINTS, THERE, SUBGOAL, BELIEF), action)
    assert np.abs(joint_action(following, JOINTS, at(4.0), SUBGOAL, None)[0] - action[0]).max() > 1e-3


def test_a_flat_policy_does_not_look_at_the_subgoal(believing):
    action = joint_action(believing, JOINTS, THERE, NOTHING, BELIEF)
    assert np.isfinite(action).all()
    np.testing.assert_array_equal(joint_action(believing, JOINTS, THERE, SUBGOAL, BELIEF), action)


def test_a_flat_policy_looks_at_joints_place_and_belief(flat_policy, believing):
    features = np.concatenate([JOINTS, THERE[:, :1] / 10.0, BELIEF.mean, np.sqrt(BELIEF.variance)], axis=-1)
    action = joint_action(believing, JOINTS, THERE, NOTHING, BELIEF)
    np.testing.assert_allclose(action, flat_policy.actor(features), atol=1e-5)
    surer = Belief(BELIEF.mean, 0.1 * BELIEF.variance)
    for other in (
        joint_action(believing, JOINTS + 0.5, THERE, NOTHING, BELIEF),
        joint_action(believing, JOINTS, at(8.0), NOTHING, BELIEF),
        joint_action(believing, JOINTS, THERE, NOTHING, Belief(BELIEF.mean + 1, BELIEF.variance)),
        joint_action(believing, JOINTS, THERE, NOTHING, surer),
    ):
        assert np.abs(other - action).max(axis=-1).min() > 1e-3


def test_subgoals_are_addressed_to_the_trackers_slots(tracker, following):
    """Whatever order the families in play have."""
    in_play = SHIPPED.only(("jump", "velocity", "goal"))
    other = TrackerController(tracker, in_play)
    assert (other.slots, following.slots) == ((-1, 1, 0), (0, 1))
    same = Subgoal(np.array([2, 1]), SUBGOAL.value)
    expected = joint_action(following, JOINTS, THERE, SUBGOAL, None)
    np.testing.assert_array_equal(joint_action(other, JOINTS, THERE, same, None), expected)


def test_a_far_place_is_shown_nearer_along_the_way_there(tracker):
    """Of two numbers, both shrink; a goal behind stays behind."""
    cautious = TrackerController(tracker, goal_ahead=0.5)
    behind = Subgoal(np.array([GOAL, GOAL]), np.array([[-4.0], [3.2]], np.float32))
    expected = tracker(JOINTS, Command(behind.slot, np.array([[-0.5], [0.2]], np.float32)))
    np.testing.assert_allclose(joint_action(cautious, JOINTS, THERE, behind, None), expected, atol=1e-6)
    quantity = Quantity("xy", ("x", "y"), "m", "place")
    place = replace(line.GOAL, quantity=quantity, targets=(Box((-5.0, -5.0), (5.0, 5.0)),), directions=())
    families = FamilySet((place, line.VELOCITY))
    actor = lively_actor(17 + command_inputs(families))
    told = Subgoal(np.array([GOAL, VELOCITY]), np.array([[4.8, 2.4], [2.0, 0.0]], np.float32))
    found = joint_action(TrackerController(Tracker(actor, families), None, 0.5), JOINTS, THERE, told, None)
    nearer = Command(told.slot, np.array([[0.3, 0.4], [2.0, 0.0]], np.float32))
    np.testing.assert_allclose(found, Tracker(actor, families)(JOINTS, nearer), atol=1e-6)


def lively_actor(observations):
    actor = eqx.filter_jit(Actor)(observations, 6, SACConfig(hidden=(8,)), jax.random.key(0))
    return eqx.tree_at(lambda a: a.net.mlp.weights[-1], actor, replace_fn=lambda w: 10 * w)
