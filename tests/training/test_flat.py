"""What a flat policy learns from: episodes of robots whose frozen module hears of a hidden task."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.bodies import RobotBatch
from rebody.control.sac import SACConfig
from rebody.store import tree_hash
from rebody.training.flat import FlatConfig, FlatLearner
from rebody.training.motion import put_on_feet
from rebody.training.off_policy import initial_state
from rebody.types import Transition, global_state

ROBOTS, STEPS, DECISIONS, TURNS = 3, 4, 5, 6
EPISODE = 2 * DECISIONS  # control steps: no multiple of a turn's
JOINTS = 17


@pytest.fixture(scope="module")
def config():
    sac = SACConfig(hidden=(8,), batch_size=8)
    return FlatConfig(
        robots=ROBOTS, steps=STEPS, decisions=DECISIONS, replay=ROBOTS * STEPS * TURNS, updates=2, sac=sac
    )


@pytest.fixture(scope="module")
def turns(cheetah, inference, config):
    """The replay after six turns, and after each what is known and the mean reward of the task."""
    batch = RobotBatch(cheetah, ROBOTS)
    batch.reset(np.random.default_rng(0))
    learner = FlatLearner(cheetah, config, inference)
    state = initial_state(learner, batch, jax.random.key(0))
    known, rewards = [], []
    for i in range(TURNS):
        world, metrics = learner.collect(state, batch, np.random.default_rng(i), jax.random.key(i))
        known.append(world)
        rewards.append(metrics["task_reward"])
        state = replace(state, world=world, iteration=np.asarray(i + 1))
    return state.replay.rows, known, rewards


def by_step(rows):
    """[control step, robot, ...]"""
    return rows.reshape(TURNS * STEPS, ROBOTS, *rows.shape[1:])


def targets(known):
    """The hidden goal at each control step; episodes begin at control steps 0, 10 and 20."""
    of_episode = [np.asarray(known[i].task.target)[:, 0] for i in (1, 4, 5)]
    return np.repeat(of_episode, [EPISODE, EPISODE, TURNS * STEPS - 2 * EPISODE], axis=0)


def test_episodes_keep_their_own_clock(turns):
    """Whatever the turns: a new task and an empty memory every five decisions."""
    _, known, _ = turns
    assert [int(each.encoder.ticks) for each in known] == [2, 4, 1, 3, 5, 2]
    tasks = [tree_hash(each.task) for each in known]
    assert tasks[0] == tasks[1]
    assert tasks[2] == tasks[3] == tasks[4]
    assert len(set(tasks)) == 3
    for each in known:
        assert (np.abs(each.task.target) <= 10).all()


def test_where_a_step_leaves_a_robot_its_next_one_begins(turns):
    replay, _, _ = turns
    observation, after = by_step(replay.observation), by_step(replay.next_observation)
    same = (after[:-1] == observation[1:]).all(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(~same) + 1, [EPISODE, 2 * EPISODE])
    begun = observation[::EPISODE]
    np.testing.assert_array_equal(begun[..., JOINTS:], np.broadcast_to([0, 0, 0, 1, 1], begun[..., JOINTS:].shape))


def test_a_belief_changes_when_a_decision_ends_and_is_the_encoders(turns, inference):
    replay, known, _ = turns
    x = 10.0 * by_step(replay.next_observation)[..., JOINTS]
    believed = by_step(replay.next_observation)[..., JOINTS + 1 :]
    held = by_step(replay.observation)[..., JOINTS + 1 :]
    changed = (believed != held).any(axis=(1, 2))
    np.testing.assert_array_equal(changed, np.arange(TURNS * STEPS) % 2 == 1)

    last = slice(EPISODE + 1, 2 * EPISODE, 2)  # the second episode's decisions
    x = x[last].T
    before = np.concatenate([np.zeros_like(x[:, :1]), x[:, :-1]], axis=1)
    earned = -np.abs(x - targets(known)[EPISODE][:, None])
    heard = Transition(global_state(x=before), earned, global_state(x=x))
    beliefs = inference.parts.module.encoder.along(heard)
    features = np.concatenate([beliefs.mean, np.sqrt(beliefs.variance)], axis=-1)
    np.testing.assert_allclose(believed[last].swapaxes(0, 1), features, atol=1e-4)


def test_it_is_paid_as_a_tracker_that_is_told(turns):
    replay, known, _ = turns
    later = 10.0 * by_step(replay.next_observation)[..., JOINTS]
    pitch, action = by_step(replay.next_observation)[..., 1], by_step(replay.action)
    miss = np.abs(targets(known) - later)
    posture = 0.5 * (1 - np.cos(pitch)) + 0.02 * np.mean(action**2, axis=-1)
    np.testing.assert_allclose(by_step(replay.reward), 0.05 / (0.1 + miss) - 0.2 * miss - posture, atol=1e-4)


def test_the_tasks_own_reward_is_reported(turns):
    replay, known, rewards = turns
    x = 10.0 * by_step(replay.next_observation)[..., JOINTS]
    earned = -np.abs(x - targets(known))[1::2].mean(axis=-1)
    np.testing.assert_allclose(rewards, earned.reshape(TURNS, 2).mean(axis=-1), rtol=1e-4)


def test_nothing_of_the_frozen_module_changes(cheetah, inference, config):
    before = tree_hash(inference.parts)
    batch = RobotBatch(cheetah, ROBOTS)
    learner = FlatLearner(cheetah, config, inference)
    state = initial_state(learner, batch, jax.random.key(0))
    learner.collect(state, batch, np.random.default_rng(0), jax.random.key(0))
    assert tree_hash(inference.parts) == before


def test_what_has_fallen_is_put_on_its_feet_where_it_lies(cheetah):
    batch = RobotBatch(cheetah, ROBOTS)
    batch.reset(np.random.default_rng(0))
    batch.qpos[:, 0] = (1.0, -2.5, 4.0)
    batch.qpos[1, 2] = np.pi  # on its back
    batch.lying_s[:] = (0.0, 5.0, 0.1)
    before = batch.qpos.copy()
    put_on_feet(batch, np.random.default_rng(1))
    np.testing.assert_array_equal(batch.x, [1.0, -2.5, 4.0])
    np.testing.assert_array_equal(batch.qpos[[0, 2]], before[[0, 2]])
    assert abs(batch.qpos[1, 2]) < 0.2
    np.testing.assert_array_equal(batch.lying_s, [0.0, 0.0, 0.1])
    batch.step(np.zeros((ROBOTS, 6)))
    np.testing.assert_allclose(batch.x, [1.0, -2.5, 4.0], atol=0.05)
