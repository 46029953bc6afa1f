"""The tracker's replay, and learning under commands that were never given."""

from dataclasses import replace

import jax
import numpy as np
import pytest

from rebody.control.command import Command, Motion
from rebody.control.tracker import MARGIN
from rebody.errors import RebodyError
from rebody.ranges import interval
from rebody.tasks import SHIPPED, FamilySet
from rebody.tasks.quantities import wrapped
from rebody.training.off_policy import initial_state
from rebody.training.tracker import train, train_tracker
from rebody.training.tracker.commands import CommandDistribution
from rebody.training.tracker.train import ControlSteps, Relabelling, TrackerLearner

GOAL, VELOCITY, STAND = range(3)  # slots
X, PITCH = 0, 4  # in a pose
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


def test_the_only_slot_is_one_of_the_robots(tmp_path, config):
    config = replace(config, commands=CommandDistribution(only="stand"))
    with pytest.raises(RebodyError, match="'cheetah' is not trained for slot 'stand'; it has: goal, velocity"):
        train_tracker("cheetah", config, tmp_path / "run", seed=0)
    assert not (tmp_path / "run").exists()


def turn(state, batch, config, i):
    TrackerLearner(batch.spec, config).collect(state, batch, np.random.default_rng(i), jax.random.key(i))
    state.iteration[...] += 1


def test_the_buffer_holds_the_last_transitions(batch, config, counted):
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    for i in range(TURNS):
        turn(state, batch, config, i)
        seen = (i + 1) * config.steps * config.robots
        held = np.arange(config.replay)
        newest = np.where(held < seen, held + (seen - 1 - held) // config.replay * config.replay, 0)
        np.testing.assert_allclose(state.replay.rows.action[:, 0], newest / 1000, atol=1e-6)
    assert seen > config.replay  # it has come round


def test_rows_of_the_buffer_belong_together(batch, config, counted):
    """Where a step leaves a robot, its next one begins, also across the end of the buffer."""
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    x, moved = batch.x, np.zeros(config.robots)
    for i in range(TURNS):
        turn(state, batch, config, i)
    buffer, seen = state.replay.rows, TURNS * config.steps * config.robots
    for number in range(seen - config.replay, seen - config.robots):
        here, after = number % config.replay, (number + config.robots) % config.replay
        np.testing.assert_array_equal(buffer.next_joints[here], buffer.joints[after])
        if buffer.command.slot[here] == buffer.command.slot[after] == GOAL and not state.world.orders.guided.any():
            left = buffer.command.value[here, 0] - buffer.motion.displacement[here, X]
            np.testing.assert_allclose(left, buffer.command.value[after, 0], atol=1e-5)
    last = (seen - config.robots + np.arange(config.robots)) % config.replay
    np.testing.assert_array_equal(buffer.next_joints[last], batch.proprioception())
    np.testing.assert_allclose(buffer.motion.pose[last], batch.pose(), rtol=1e-6)
    for number in range(seen - config.replay, seen):
        moved[number % config.robots] += buffer.motion.displacement[number % config.replay, X]
    assert np.abs(batch.x - x).max() > 0
    assert (np.abs(moved) <= np.abs(batch.x - x) + 0.1).all()


def test_a_goal_comes_nearer_by_what_the_robot_moved(batch, config, counted):
    config = replace(config, guided_share=0.0)
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    turn(state, batch, config, 0)
    buffer = jax.tree.map(lambda rows: rows[: config.steps * config.robots], state.replay.rows)
    buffer = jax.tree.map(lambda rows: rows.reshape(config.steps, config.robots, *rows.shape[1:]), buffer)
    nearer = np.where(buffer.command.slot == GOAL, buffer.motion.displacement[..., X], 0.0)
    value = buffer.command.value[..., 0]
    np.testing.assert_allclose(value[1:], (value - nearer)[:-1], atol=1e-5)


def test_what_has_fallen_starts_anew_with_a_new_order(batch, config):
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    turn(state, batch, config, 0)
    batch.lying_s[:] = (0.0, 5.0, 0.0)
    before, left = batch.qpos.copy(), state.world.orders.steps_left.copy()
    train.begin_anew(state.world, batch, batch.fallen, np.random.default_rng(0))
    np.testing.assert_array_equal((batch.qpos != before).any(axis=1), [False, True, False])
    assert batch.x[1] == 0
    assert batch.observe().vx[1] == 0
    np.testing.assert_array_equal(state.world.orders.steps_left, [left[0], 0, left[2]])
    assert batch.lying_s[1] == 0


@pytest.fixture
def relabelled(config):
    """(transitions, what is learned from them), most of them short of every limit."""
    rng, size = np.random.default_rng(1), 400
    transitions = ControlSteps(
        joints=rng.normal(size=(size, 17)).astype(np.float32),
        action=rng.uniform(-1, 1, (size, 6)).astype(np.float32),
        next_joints=rng.normal(size=(size, 17)).astype(np.float32),
        motion=Motion(
            displacement=planar(rng.normal(0, 0.1, (size, 6))),
            pose=planar(rng.uniform(-3, 3, (size, 6))),
            velocity=planar(rng.normal(0, 2, (size, 6))),
            fell=rng.random(size) < 0.1,
        ),
        command=Command(
            rng.integers(GOAL, VELOCITY + 1, size).astype(np.int32), rng.uniform(-3, 3, (size, 1)).astype(np.float32)
        ),
    )
    return transitions, Relabelling(config, CONTROL_DT)(transitions, jax.random.key(2))


def planar(moved):
    """The same in the plane of x and z."""
    return (moved * (1, 0, 1, 0, 1, 0)).astype(np.float32)


def told(observation):
    """(whether it is a goal, value) of the command in each observation."""
    is_goal, is_speed, ahead, _, _, speed = np.asarray(observation)[:, 17:].T
    np.testing.assert_array_equal(is_goal + is_speed, 1)
    return is_goal == 1, np.where(is_goal, ahead * MARGIN * 5.0, speed)


def test_half_of_a_batch_learns_under_its_own_command(relabelled, config):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation)
    half = len(value) // 2
    np.testing.assert_array_equal(is_goal[half:], transitions.command.slot[half:] == GOAL)
    np.testing.assert_allclose(value[half:], transitions.command.value[half:, 0], rtol=1e-5)
    assert np.mean(np.abs(value[:half] - transitions.command.value[:half, 0]) > 1e-4) > 0.95
    assert np.mean(is_goal[:half]) == pytest.approx(0.5, abs=0.1)
    assert np.mean(value[:half] == 0) == pytest.approx(config.commands.zero_share, abs=0.06)


def test_everything_but_the_command_is_as_it_was(relabelled):
    transitions, batch = relabelled
    np.testing.assert_array_equal(batch.observation[:, :17], transitions.joints)
    np.testing.assert_array_equal(batch.next_observation[:, :17], transitions.next_joints)
    np.testing.assert_array_equal(batch.action, transitions.action)
    np.testing.assert_array_equal(batch.terminal, transitions.motion.fell)


def test_the_reward_is_what_the_command_would_have_brought(relabelled):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation)
    motion = transitions.motion
    miss = np.abs(value - motion.displacement[:, X])
    goal = 0.5 * 0.1 / (0.1 + miss) - 0.2 * miss
    velocity = -0.4 * np.abs(value - motion.velocity[:, X])
    posture = -0.5 * (1 - np.cos(motion.pose[:, PITCH])) - 0.02 * np.mean(transitions.action**2, axis=1)
    np.testing.assert_allclose(batch.reward, np.where(is_goal, goal, velocity) + posture, rtol=1e-4, atol=1e-5)


def test_afterwards_a_goal_is_nearer_and_a_speed_the_same(relabelled):
    transitions, batch = relabelled
    is_goal, value = told(batch.observation)
    later_is_goal, later = told(batch.next_observation)
    np.testing.assert_array_equal(later_is_goal, is_goal)
    expected = value - np.where(is_goal, transitions.motion.displacement[:, X], 0.0)
    within = np.abs(expected) < MARGIN * 5.0
    np.testing.assert_allclose(later[within], expected[within], atol=1e-5)


def test_relabelling_can_be_turned_off(relabelled, config):
    transitions, _ = relabelled
    batch = Relabelling(replace(config, relabelled=0.0), CONTROL_DT)(transitions, jax.random.key(2))
    is_goal, value = told(batch.observation)
    np.testing.assert_array_equal(is_goal, transitions.command.slot == GOAL)
    np.testing.assert_allclose(value, transitions.command.value[:, 0], rtol=1e-5)


def test_a_fall_ends_what_is_learned_and_nothing_else_does(batch, config, counted):
    """Robot 1 has lain on its back for almost long enough."""
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    batch.qpos[1, batch.spec.root_addresses[2]] = np.pi
    batch.lying_s[1] = 0.98
    turn(state, batch, config, 0)
    rows = config.steps * config.robots
    seen = jax.tree.map(lambda leaf: leaf[:rows], state.replay.rows)
    assert np.flatnonzero(seen.motion.fell).tolist() == [1]
    assert np.abs(seen.next_joints[1, 1]) > 2.5  # its pitch: what is learned is how it lay
    assert np.abs(seen.joints[1 + config.robots, 1]) < 0.2  # and then it stood again
    learned = Relabelling(config, CONTROL_DT)(seen, jax.random.key(0))
    assert np.flatnonzero(learned.terminal).tolist() == [1]


def test_pushes_come_as_often_and_are_as_large_as_the_settings_say(batch, config):
    config, rng, pushed = replace(config, push=0.4, push_every_s=0.5), np.random.default_rng(0), []
    for _ in range(3000):
        batch.qvel[:] = 0.0
        train.push(batch, config, rng)
        assert not batch.qvel[:, 1:].any()
        pushed.extend(batch.qvel[:, 0])
    change = np.array(pushed)[np.flatnonzero(pushed)]
    assert len(change) / len(pushed) == pytest.approx(CONTROL_DT / 0.5, rel=0.13)  # four standard deviations
    np.testing.assert_allclose(np.sort(change), np.linspace(-0.4, 0.4, len(change)), atol=0.06)
    assert np.abs(change).max() <= 0.4


def test_a_push_is_seen_before_the_robot_acts(batch, config, counted):
    """It is no work of the action's: the speed changes between two steps, not within one."""
    state = initial_state(TrackerLearner(batch.spec, config), batch, jax.random.key(0))
    turn(state, batch, replace(config, push=0.4, push_every_s=CONTROL_DT), 0)
    buffer, speed = state.replay.rows, 8  # after z, pitch and six joints
    change = buffer.joints[3:12] - buffer.next_joints[:9]
    assert (np.abs(change[:, speed]) > 1e-4).all()
    assert np.abs(change[:, speed]).max() < 0.4 + 1e-5
    np.testing.assert_array_equal(np.delete(change, speed, axis=1), 0)


def test_under_a_new_command_a_wanted_pitch_stays_in_the_world(relabelled, config):
    transitions, _ = relabelled
    standing = replace(config, relabelled=1.0, families=that_stand(config))
    batch = Relabelling(standing, CONTROL_DT)(transitions, jax.random.key(2))
    stands, turn, later = (np.asarray(o) for o in (batch.observation[:, 19] == 1, *pitches(batch)))
    assert np.mean(stands) == pytest.approx(1 / 3, abs=0.1)
    assert not turn[~stands].any()
    motion = transitions.motion
    pitch, turned = motion.pose[:, PITCH], motion.displacement[:, PITCH]
    wanted = wrapped(pitch - turned + turn)[stands]
    np.testing.assert_allclose(wrapped(pitch + later)[stands], wanted, atol=1e-5)
    assert MARGIN * -0.5 - 1e-5 <= wanted.min() < -0.4
    assert 0.9 < wanted.max() <= MARGIN * 1.0 + 1e-5
    miss = np.abs(later[stands])
    energy = 0.02 * np.mean(transitions.action[stands] ** 2, axis=1)
    np.testing.assert_allclose(batch.reward[stands], 0.05 / (0.1 + miss) - 0.5 * miss - energy, rtol=1e-4, atol=1e-5)


def that_stand(config):
    """The commands, and to stand at pitches."""
    return config.families.beside(FamilySet((SHIPPED.named("stand").within(interval(-0.5, 1.0)),)))


def pitches(batch):
    """What each robot is to turn, before and after the step [rad]."""
    return batch.observation[:, 24], batch.next_observation[:, 24]


def test_its_own_command_to_stand_is_kept(relabelled, config):
    transitions, _ = relabelled
    told = replace(transitions.command, slot=np.full(400, STAND, np.int32))
    standing = replace(config, relabelled=0.0, families=that_stand(config))
    batch = Relabelling(standing, CONTROL_DT)(replace(transitions, command=told), jax.random.key(2))
    turn, later = pitches(batch)
    np.testing.assert_array_equal(turn, told.value[:, 0])
    np.testing.assert_allclose(later, told.value[:, 0] - transitions.motion.displacement[:, PITCH], atol=1e-6)
