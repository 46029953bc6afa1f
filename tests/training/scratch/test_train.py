"""What a robot learns everything from: its own episodes, with the beliefs of the module that learns beside it."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from rebody.bodies import RobotBatch
from rebody.control.flat import FlatView
from rebody.control.places import Place, TaskCode
from rebody.control.sac import SACConfig
from rebody.errors import RebodyError
from rebody.inference import InferenceConfig
from rebody.ranges import interval
from rebody.tasks import line
from rebody.training.inference.episodes import with_tasks
from rebody.training.scratch import ScratchConfig
from rebody.training.scratch.train import collect, initial_state, interpret, sample_steps
from rebody.training.task_inference import begin_inference
from rebody.types import Task, Transition, global_state

ROBOTS, DECISIONS, GROUPS, START = 3, 5, 2, 15.0
PER_DECISION, JOINTS = 2, 17
GOAL = 0
PLACES = (Place(line.GOAL.quantity, (10.0,)), Place(line.VELOCITY.quantity, (3.0,)))
VIEW = FlatView(PLACES)


@pytest.fixture(scope="module")
def config():
    inference = InferenceConfig(("x", "vx"), (10.0, 3.0), 1.0, window=4, latent=6, kinds=2, units=8)
    sac = SACConfig(hidden=(8,), batch_size=500)
    return ScratchConfig(robots=ROBOTS, decisions=DECISIONS, groups=GROUPS, inference=inference, sac=sac)


@pytest.fixture(scope="module")
def meta(config, cheetah):
    return config.meta(cheetah.reach)


@pytest.fixture(scope="module")
def state(config, cheetah):
    return initial_state(config, RobotBatch(cheetah, ROBOTS), jax.random.key(0))


@pytest.fixture(scope="module")
def group(config, state, cheetah):
    batch = RobotBatch(cheetah, ROBOTS)
    return collect(state, batch, config, np.random.default_rng(0), jax.random.key(0))


def test_tasks_are_within_reach_and_starts_anywhere(group, meta):
    assert meta.families.ranges == {"goal": interval(-15.0, 15.0), "velocity": interval(-3.0, 3.0)}
    begun = group.episodes.state.x[:, 0]
    assert (np.abs(begun) <= START).all()
    assert np.ptp(begun) > 1.0


def test_where_a_step_leaves_a_robot_its_next_one_begins(group):
    steps = group.steps
    np.testing.assert_array_equal(steps.next_pose[:-1], steps.pose[1:])
    np.testing.assert_array_equal(steps.next_joints[:-1], steps.joints[1:])
    assert steps.pose.shape == (DECISIONS * PER_DECISION, ROBOTS, 6)


def test_decisions_and_control_steps_tell_of_the_same_motion(group):
    episodes, steps = group.episodes, group.steps
    np.testing.assert_array_equal(episodes.state.x[:, :-1].T, steps.pose[::PER_DECISION, :, 0])
    np.testing.assert_allclose(episodes.state.vx[:, 1:], np.diff(episodes.state.x) / 0.1, atol=1e-4)
    of_decision = steps.action.reshape(DECISIONS, PER_DECISION, ROBOTS, -1).mean(axis=1)
    np.testing.assert_allclose(episodes.action, of_decision.swapaxes(0, 1), atol=1e-6)


def test_the_module_hears_the_tasks_own_reward_and_the_beliefs_are_its_own(group, state, meta):
    episodes = group.episodes
    after = jax.tree.map(lambda leaf: leaf[:, 1:], episodes.state)
    before = jax.tree.map(lambda leaf: leaf[:, :-1], episodes.state)
    task = jax.tree.map(jnp.asarray, episodes.task)
    np.testing.assert_allclose(episodes.reward, meta.families.reward(task, after), rtol=1e-5)
    first = jax.tree.map(lambda leaf: leaf[:, :4], Transition(before, episodes.reward, after))  # a window
    beliefs = state.module.encoder.along(first)
    np.testing.assert_allclose(episodes.belief.mean[:, 1:5], beliefs.mean, atol=1e-4)
    np.testing.assert_array_equal(episodes.belief.mean[:, 0], 0.0)


def test_going_to_a_goal_is_paid_by_how_well_its_speed_is_held(config, state, cheetah):
    """Wanted is 1.5 times what is left a second, at most 3 m/s."""
    still = replace(config, switch_share=0.0)
    batch = RobotBatch(cheetah, ROBOTS)
    group = collect(state, batch, still, np.random.default_rng(0), jax.random.key(3))
    steps, is_goal = group.steps, group.episodes.task.family[:, 0] == GOAL
    assert is_goal.any()
    left = (group.episodes.task.target[:, 0, 0] - steps.next_pose[..., 0])[:, is_goal]
    wanted, speed = np.clip(1.5 * left, -3.0, 3.0), (steps.next_pose - steps.pose)[:, is_goal, 0] / 0.05
    held = np.maximum(1 - np.abs(wanted - speed) / np.maximum(np.abs(wanted), 0.5), -0.5)
    posture = 0.5 * (1 - np.cos(steps.next_joints[..., 1])) + 0.02 * np.mean(steps.action**2, axis=-1)
    expected = 0.5 * held + 0.02 / (0.1 + np.abs(left)) - posture[:, is_goal]
    np.testing.assert_allclose(steps.reward[:, is_goal], expected, atol=1e-4)


def seen_at(steps, step, robot, known):
    """What the policy sees before and after a control step of the first group, by what is known at its decisions."""
    ends = (steps.joints, steps.pose, step), (steps.next_joints, steps.next_pose, step + 1)
    return [
        VIEW(
            joints[step, robot],
            jnp.asarray(pose[step, robot]),
            jax.tree.map(lambda leaf: leaf[0, robot, at // PER_DECISION], known),  # noqa: B023 (used at once)
        )
        for joints, pose, at in ends
    ]


def test_a_control_step_is_learned_from_with_the_belief_of_its_decision_or_the_truth(config, state, group):
    """Whose sample is which shows by x, which no two control steps share."""
    replay = jax.tree.map(lambda leaf: jnp.stack([leaf, leaf]), group)
    believed = state.module.decoder.interpret(replay.episodes.belief)
    told = with_tasks(replay.episodes, TaskCode(PLACES)).belief
    batch = sample_steps(replay, believed, told, 2, config, jax.random.key(1))
    steps, times_told = group.steps, 0
    for row in range(100):
        step, robot = np.argwhere((steps.joints == batch.observation[row, :JOINTS]).all(axis=-1))[0]
        seen = [batch.observation[row], batch.next_observation[row]]
        is_told = np.allclose(seen[0], seen_at(steps, step, robot, told)[0], atol=1e-6)
        np.testing.assert_allclose(seen, seen_at(steps, step, robot, told if is_told else believed), atol=1e-6)
        assert batch.reward[row] == pytest.approx(float(steps.reward[step, robot]), abs=1e-6)
        times_told += is_told
    assert 30 < times_told < 70  # of 100, half


def test_who_is_told_goes_by_the_truth_in_the_terms_of_a_belief(config, state):
    """A goal at -5 m: meant is x, half of its scale to the back, no doubt."""
    four = replace(config, robots=4)
    task = Task(np.full(4, GOAL, np.int32), np.full((4, 1), -5.0, np.float32))
    known = begin_inference(state.module.encoder, global_state(x=np.zeros(4, np.float32)), task)
    gone_by = interpret(state.module, known, four)
    np.testing.assert_allclose(gone_by.mean[:2], [[1.0, 0.0, -0.5, 0.0]] * 2)
    assert not np.asarray(gone_by.variance[:2]).any()
    believed = state.module.decoder.interpret(known.belief)
    np.testing.assert_allclose(gone_by.mean[2:], believed.mean[2:])
    np.testing.assert_allclose(gone_by.variance[2:], believed.variance[2:])


def test_a_latent_that_says_no_places_is_refused(config):
    with pytest.raises(RebodyError, match=r"--inference\.kinds must be at least 1"):
        replace(config, inference=replace(config.inference, kinds=0))


def test_the_policy_sees_goals_from_where_it_is_and_speeds_as_they_are(state):
    understood = state.module.decoder.interpret(state.module.encoder.prior((1,)))
    joints = np.zeros((1, JOINTS), np.float32)
    here, there = (VIEW(joints, np.array([[x, 0, 0, 0, 0, 0]], np.float32), understood) for x in (0.0, 1.0))
    moved = np.flatnonzero(np.asarray(here != there)[0])
    np.testing.assert_array_equal(moved, [JOINTS + 2])  # how far ahead the goal is
