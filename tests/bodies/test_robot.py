"""Robots move as Gymnasium's do, the same for any number of threads, and say when something is wrong."""

from dataclasses import replace

import gymnasium
import mujoco
import numpy as np
import pytest

from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.robot import wrap_angle
from rebody.errors import RebodyError

STEPS = 60


def batch_of(spec, size, threads=1, seed=0):
    batch = RobotBatch(spec, size, threads)
    batch.reset(np.random.default_rng(seed))
    return batch


def actions_of(size, steps=STEPS, seed=1):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, size, 6)).astype(np.float32)


def roll(batch, actions):
    """qpos and qvel after each step."""
    history = []
    for action in actions:
        batch.step(action)
        history.append(np.concatenate([batch.qpos, batch.qvel], axis=-1))
    return np.stack(history)


def test_moves_bit_for_bit_as_gymnasiums(cheetah, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves its log of the model's deprecated attribute there
    env = gymnasium.make("HalfCheetah-v5").unwrapped
    env.reset(seed=3)
    batch = batch_of(cheetah, 1)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.zeros(mujoco.mj_stateSize(env.model, kind))
    mujoco.mj_getState(env.model, env.data, state, kind)
    batch.state = state[None]
    for action in actions_of(1):
        env.step(action[0])
        batch.step(action)
        np.testing.assert_array_equal(batch.qpos[0], env.data.qpos)
        np.testing.assert_array_equal(batch.qvel[0], env.data.qvel)


def test_threads_do_not_change_a_bit(cheetah):
    one, two = (roll(batch_of(cheetah, 5, threads), actions_of(5)) for threads in (1, 2))
    np.testing.assert_array_equal(one, two)


def test_continues_bit_exactly_from_a_saved_state(cheetah):
    actions = actions_of(3)
    batch = batch_of(cheetah, 3)
    roll(batch, actions[:20])
    saved = batch.state
    expected = roll(batch, actions[20:])
    other = batch_of(cheetah, 3, seed=9)
    other.state = saved
    np.testing.assert_array_equal(roll(other, actions[20:]), expected)


def test_actions_beyond_their_bounds_are_clipped(cheetah):
    beyond, at = (roll(batch_of(cheetah, 1), scale * np.ones((5, 1, 6))) for scale in (7.0, 1.0))
    np.testing.assert_array_equal(beyond, at)


def test_reset_of_some_leaves_the_others(cheetah):
    batch = batch_of(cheetah, 3)
    roll(batch, actions_of(3))
    before = batch.state
    batch.reset(np.random.default_rng(5), np.array([False, True, False]))
    np.testing.assert_array_equal(batch.state[[0, 2]], before[[0, 2]])
    assert batch.qpos[1, 0] == 0.0
    assert np.abs(batch.qpos[1]).max() <= cheetah.reset_noise


def test_velocity_is_displacement_over_a_decision(cheetah):
    batch = batch_of(cheetah, 4)
    before = batch.qpos.copy()
    roll(batch, actions_of(4, cheetah.steps_per_decision))
    state = cheetah.observe(batch.qpos, before)
    np.testing.assert_allclose(state.vx, (batch.qpos[:, 0] - before[:, 0]) / 0.1, rtol=1e-6)
    np.testing.assert_allclose(state.vz, (batch.qpos[:, 1] - before[:, 1]) / 0.1, rtol=1e-6)
    np.testing.assert_allclose(state.pitch_rate, (batch.qpos[:, 2] - before[:, 2]) / 0.1, rtol=1e-6)
    np.testing.assert_allclose(state.x, batch.qpos[:, 0], rtol=1e-6)
    assert not state.y.any()


def test_wrap_angle():
    turns = 2 * np.pi * np.arange(-3, 4)
    np.testing.assert_allclose(wrap_angle(1.2 + turns), 1.2)
    np.testing.assert_allclose(wrap_angle(-3.0 + turns), -3.0)
    np.testing.assert_allclose(wrap_angle(np.array([np.pi, -np.pi, 0.0])), [np.pi, np.pi, 0.0])


def test_joint_state_does_not_know_where_it_is_nor_how_often_it_turned(cheetah):
    rng = np.random.default_rng(0)
    qpos, qvel = rng.normal(size=(2, 9)), rng.normal(size=(2, 9))
    moved = qpos + np.array([5.0, 0, 2 * np.pi, 0, 0, 0, 0, 0, 0])
    assert cheetah.joint_state(qpos, qvel).shape == (2, 17)
    np.testing.assert_allclose(cheetah.joint_state(moved, qvel), cheetah.joint_state(qpos, qvel), atol=1e-5)


def test_lies_on_its_back_only(cheetah):
    qpos = np.zeros((3, 9))
    qpos[:, 2] = [0.0, 1.5, np.pi]
    assert cheetah.lies(qpos).tolist() == [False, False, True]


def test_a_control_step_that_does_not_divide_a_decision_is_refused(cheetah):
    assert cheetah.steps_per_decision == 2
    with pytest.raises(RebodyError, match=r"0\.03 s does not divide a decision.*frame_skip"):
        _ = replace(cheetah, frame_skip=3).steps_per_decision


@pytest.mark.parametrize("speed", [1e6, np.nan])
def test_a_diverged_simulation_is_an_error_until_mended(cheetah, speed, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs it
    batch = batch_of(cheetah, 2)
    sound = batch.state
    batch.qvel[1] = speed
    with pytest.raises(RebodyError, match="'cheetah' diverged"):
        batch.step(np.zeros((2, 6)))
    batch.state = sound
    batch.step(np.zeros((2, 6)))


def test_compiling_the_model_is_silent_and_leaves_no_log(cheetah, capfd, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert replace(cheetah).model.body_mass.sum() == pytest.approx(14.0)
    assert capfd.readouterr() == ("", "")
    assert not list(tmp_path.iterdir())


def test_unknown_robot():
    with pytest.raises(RebodyError, match=r"did you mean 'cheetah'\?"):
        load_robot("chetah")
