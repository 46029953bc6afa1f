"""The tracker's replay, and learning under commands that were never given."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.tasks import GOAL, VELOCITY
from rebody.training.tracker import train
from rebody.training.tracker.train import Replay, collect, initial_state, relabel

CONTROL_DT = 0.05
TURNS = 4


@pytest.fixture
def counted(monkeypatch):
    """Lets every robot act by the number of the transition, so that a row says which one it holds."""
    count = 0

    def number(actor, joints, command, key, config):
        nonlocal count
        action = np.zeros((len(joints), 6), np.float32)
        action[:, 0] = (count + np.arange(len(joints))) / 1000
        count += len(joints)
        return action

    monkeypatch.setattr(train, "_explore", number)


def turn(state, batch, config, i):
    collect(state, batch, config, np.random.default_rng(i), jax.random.key(i))
    state.iteration[...] += 1


def test_the_ring_holds_the_last_transitions(batch, config, counted):
    state = initial_state(config, batch, jax.random.key(0))
    for i in range(TURNS):
        turn(state, batch, config, i)
        seen = (i + 1) * config.steps * config.robots
        held = np.arange(config.replay)
        newest = np.where(held < seen, held + (seen - 1 - held) // config.replay * config.replay, 0)
        np.testing.assert_allclose(state.replay.action[:, 0], newest / 1000, atol=1e-6)
    assert seen > config.replay  # it has come round


def test_rows_of_the_ring_belong_together(batch, config, counted):
    """Where a step leaves a robot, its next one begins, also across the end of the ring."""
    state = initial_state(config, batch, jax.random.key(0))
    x, moved = batch.x, np.zeros(config.robots)
    for i in range(TURNS):
        turn(state, batch, config, i)
    ring, seen = state.replay, TURNS * config.steps * config.robots
    for number in range(seen - config.replay, seen - config.robots):
        here, after = number % config.replay, (number + config.robots) % config.replay
        np.testing.assert_array_equal(ring.next_joints[here], ring.joints[after])
        if ring.slot[here] == ring.slot[after] == GOAL and not state.orders.guided.any():
            np.testing.assert_allclose(ring.value[here] - ring.displacement[here], ring.value[after], atol=1e-5)
    last = (seen - config.robots + np.arange(config.robots)) % config.replay
    np.testing.assert_array_equal(ring.next_joints[last], batch.spec.joint_state(batch.qpos, batch.qvel))
    np.testing.assert_allclose(ring.pitch[last], batch.spec.pitch(batch.qpos), rtol=1e-6)
    for number in range(seen - config.replay, seen):
        moved[number % config.robots] += ring.displacement[number % config.replay]
    assert np.abs(batch.x - x).max() > 0
    assert (np.abs(moved) <= np.abs(batch.x - x) + 0.1).all()


def test_a_goal_comes_nearer_by_what_the_robot_moved(batch, config, counted):
    config = replace(config, guided_share=0.0)
    state = initial_state(config, batch, jax.random.key(0))
    turn(state, batch, config, 0)
    ring = jax.tree.map(lambda rows: rows[: config.steps * config.robots], state.replay)
    ring = jax.tree.map(lambda rows: rows.reshape(config.steps, config.robots, *rows.shape[1:]), ring)
    nearer = np.where(ring.slot == GOAL, ring.displacement, 0.0)
    np.testing.assert_allclose(ring.value[1:], (ring.value - nearer)[:-1], atol=1e-5)


def test_what_has_fallen_starts_anew_with_a_new_order(batch, config):
    state = initial_state(config, batch, jax.random.key(0))
    turn(state, batch, config, 0)
    batch.lying_s[:] = (0.0, 5.0, 0.0)
    before, left = batch.qpos.copy(), state.orders.steps_left.copy()
    train.reset_the_fallen(state, batch, np.random.default_rng(0))
    np.testing.assert_array_equal((batch.qpos != before).any(axis=1), [False, True, False])
    assert batch.x[1] == 0
    np.testing.assert_array_equal(state.previous_qpos[1], batch.qpos[1])
    np.testing.assert_array_equal(state.orders.steps_left, [left[0], 0, left[2]])
    assert batch.lying_s[1] == 0


@pytest.fixture
def relabelled(config):
    """(transitions, what is learned from them), most of them short of every limit."""
    rng, size = np.random.default_rng(1), 400
    transitions = Replay(
        joints=rng.normal(size=(size, 17)).astype(np.float32),
        action=rng.uniform(-1, 1, (size, 6)).astype(np.float32),
        next_joints=rng.normal(size=(size, 17)).astype(np.float32),
        displacement=rng.normal(0, 0.1, size).astype(np.float32),
        pitch=rng.uniform(-3, 3, size).astype(np.float32),
        slot=rng.integers(GOAL, VELOCITY + 1, size).astype(np.int32),
        value=rng.uniform(-3, 3, size).astype(np.float32),
    )
    return transitions, relabel(transitions, jax.random.key(2), config, CONTROL_DT)


def told(observation, config):
    """(whether it is a goal, value) of the command in each observation."""
    is_goal, is_speed, ahead, _, _, speed = np.asarray(observation)[:, 17:].T
    np.testing.assert_array_equal(is_goal + is_speed, 1)
    return is_goal == 1, np.where(is_goal, ahead * config.commands.max_distance, speed)


def test_half_of_a_batch_learns_under_its_own_command(relabelled, config):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation, config)
    half = len(value) // 2
    np.testing.assert_array_equal(is_goal[half:], transitions.slot[half:] == GOAL)
    np.testing.assert_allclose(value[half:], transitions.value[half:], rtol=1e-5)
    assert np.mean(np.abs(value[:half] - transitions.value[:half]) > 1e-4) > 0.95
    assert np.mean(is_goal[:half]) == pytest.approx(0.5, abs=0.1)
    assert np.mean(value[:half] == 0) == pytest.approx(config.commands.zero_share, abs=0.06)


def test_everything_but_the_command_is_as_it_was(relabelled):
    transitions, batch = relabelled
    np.testing.assert_array_equal(batch.observation[:, :17], transitions.joints)
    np.testing.assert_array_equal(batch.next_observation[:, :17], transitions.next_joints)
    np.testing.assert_array_equal(batch.action, transitions.action)
    assert not np.asarray(batch.terminal).any()


def test_the_reward_is_what_the_command_would_have_brought(relabelled, config):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation, config)
    miss = np.abs(value - transitions.displacement)
    goal = 0.5 * 0.1 / (0.1 + miss) - 0.2 * miss
    velocity = -0.4 * np.abs(value - transitions.displacement / CONTROL_DT)
    posture = -0.5 * (1 - np.cos(transitions.pitch)) - 0.02 * np.mean(transitions.action**2, axis=1)
    np.testing.assert_allclose(batch.reward, np.where(is_goal, goal, velocity) + posture, rtol=1e-4, atol=1e-5)


def test_afterwards_a_goal_is_nearer_and_a_speed_the_same(relabelled, config):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation, config)
    later_is_goal, later = told(batch.next_observation, config)
    np.testing.assert_array_equal(later_is_goal, is_goal)
    expected = value - np.where(is_goal, transitions.displacement, 0.0)
    within = np.abs(expected) < config.commands.max_distance
    np.testing.assert_allclose(later[within], expected[within], atol=1e-5)


def test_relabelling_can_be_turned_off(relabelled, config):
    transitions, _ = relabelled
    batch = relabel(transitions, jax.random.key(2), replace(config, relabelled=0.0), CONTROL_DT)
    is_goal, value = told(batch.observation, config)
    np.testing.assert_array_equal(is_goal, transitions.slot == GOAL)
    np.testing.assert_allclose(value, transitions.value, rtol=1e-5)
