"""Robots move as Gymnasium's do, the same for any number of threads, and say when something is wrong."""

from dataclasses import replace
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
import pytest

from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.robot import wrap_angle
from rebody.bodies.source import model_file
from rebody.control.places import reachable
from rebody.errors import RebodyError
from rebody.ranges import interval
from rebody.tasks import SHIPPED

STEPS = 60
ANT = str(Path(__file__).parents[2] / "examples" / "ant" / "ant.toml")


def batch_of(spec, size, threads=1, seed=0):
    batch = RobotBatch(spec, size, threads)
    batch.reset(np.random.default_rng(seed))
    return batch


def actions_of(size, steps=STEPS, seed=1, actuators=6):
    return np.random.default_rng(seed).uniform(-1, 1, (steps, size, actuators)).astype(np.float32)


def roll(batch, actions):
    """qpos and qvel after each step."""
    history = []
    for action in actions:
        batch.step(action)
        history.append(np.concatenate([batch.qpos, batch.qvel], axis=-1))
    return np.stack(history)


@pytest.fixture(scope="module")
def walker():
    return load_robot("walker")


@pytest.mark.parametrize(
    ("name", "theirs"), [("cheetah", "HalfCheetah-v5"), ("hopper", "Hopper-v5"), ("walker", "Walker2d-v5")]
)
def test_moves_bit_for_bit_as_gymnasiums(name, theirs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves its log of the model's deprecated attribute there
    spec = load_robot(name)
    env = gymnasium.make(theirs, frame_skip=spec.frame_skip).unwrapped
    env.reset(seed=3)
    batch = batch_of(spec, 1)
    kind = mujoco.mjtState.mjSTATE_INTEGRATION
    state = np.zeros(mujoco.mj_stateSize(env.model, kind))
    mujoco.mj_getState(env.model, env.data, state, kind)
    fresh = batch.state  # it has not lain, and stood
    fresh[0, : len(state)] = state
    batch.state = fresh
    for action in actions_of(1, actuators=spec.model.nu):
        env.step(action[0])
        batch.step(action)
        np.testing.assert_array_equal(batch.qpos[0], env.data.qpos)
        np.testing.assert_array_equal(batch.qvel[0], env.data.qvel)


@pytest.mark.parametrize(
    ("family", "asked", "reached"),
    [
        ("velocity", (-3.0, 3.0), (-1.0, 2.0)),
        ("velocity", (0.5, 1.5), (0.5, 1.5)),
        ("goal", (-15.0, 15.0), (-15.0, 15.0)),  # farther than a tracker is shown
        ("jump", (0.5, 3.0), (1.0, 2.0)),
        ("stand", (-1.0, 1.0), (-1.0, 1.0)),  # it has no such slot to say
    ],
)
def test_targets_are_cut_to_what_a_robot_reaches(family, asked, reached):
    reach = {"goal": interval(-5.0, 5.0), "velocity": interval(-1.0, 2.0), "jump": interval(1.0, 2.0)}
    asks = SHIPPED.named(family).within(interval(*asked))
    assert reachable(asks, reach.get(family)) == interval(*reached)


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
    seen = cheetah.joint_state(qpos, qvel)
    assert seen.shape == (2, 17)
    np.testing.assert_allclose(cheetah.joint_state(moved, qvel), seen, atol=1e-5)


def test_pace_is_the_speed_of_a_control_step_or_its_mean_over_the_last_ones(cheetah, walker):
    assert cheetah.next_pace(np.array(5.0), np.array(0.1)) == pytest.approx(0.1 / cheetah.control_dt)
    pace, steps = np.zeros(1), round(walker.smoothing_s / walker.control_dt)
    for i in range(5 * steps):
        speed = 1.0 + 0.5 * np.sin(2 * np.pi * i / (steps / 2))  # a gait with a period of half the time constant
        pace = walker.next_pace(pace, np.array([speed * walker.control_dt]))
        if i == steps - 1:
            assert pace == pytest.approx(1 - np.exp(-1), abs=0.12)
    assert pace == pytest.approx(1.0, abs=0.12)


def test_a_batch_knows_its_pace(walker):
    """A tracker sees it last, it begins anew with a robot, and is restored with the state."""
    batch, twin = batch_of(walker, 3), batch_of(walker, 3)
    batch.push(np.array([1.0, 0.0, -1.0]))
    batch.step(np.zeros((3, 6)))
    assert (np.sign(batch.pace) == np.sign(batch.x)).all()
    np.testing.assert_allclose(batch.pace, batch.x / walker.smoothing_s)
    seen = batch.proprioception()
    np.testing.assert_array_equal(seen[:, :-1], batch.joint_state())
    np.testing.assert_array_equal(seen[:, -1], batch.pace.astype(np.float32))
    twin.state = batch.state
    for robots in (batch, twin):
        robots.step(np.ones((3, 6)))
    np.testing.assert_array_equal(twin.proprioception(), batch.proprioception())
    batch.reset(np.random.default_rng(0), np.array([True, False, False]))
    np.testing.assert_array_equal(batch.pace, [0.0, *twin.pace[1:]])


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


@pytest.mark.parametrize("name", ["cheetah", "hopper", "walker"])
def test_a_push_changes_the_speed_of_the_centre_of_mass_by_what_it_says(name):
    batch = batch_of(load_robot(name), 3)
    roll(batch, actions_of(3, 10, actuators=batch.spec.model.nu))  # so that all parts move
    before, change = batch.qvel.copy(), np.array([0.3, 0.0, -2.0])
    speeds = [centre_of_mass_velocity(batch, qvel) for qvel in (before, pushed(batch, change))]
    np.testing.assert_allclose(speeds[1] - speeds[0], np.outer(change, [1, 0, 0]), atol=1e-12)


def pushed(batch, change):
    batch.push(change)
    return batch.qvel


def centre_of_mass_velocity(batch, qvel):
    """Of the robot alone [m/s]."""
    model, found = batch.spec.model, []
    data = mujoco.MjData(model)
    for data.qpos[:], data.qvel[:] in zip(batch.qpos, qvel, strict=True):
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        found.append(data.subtree_linvel[0].copy())
    return np.array(found)


# a body that floats freely, held to the plane


def thrown(spec, steps):
    """x, z and pitch, and all other joints, after each control step of the body itself and of the one held."""
    free = mujoco.MjModel.from_xml_path(str(model_file(spec.mjcf, spec.name)))
    data, batch = mujoco.MjData(free), RobotBatch(spec, 1, threads=1)
    batch.reset(np.random.default_rng(0))
    batch.qpos[:], batch.qvel[:] = spec.model.qpos0, 0.0
    batch.qpos[0, 1] += 3.0
    data.qpos[2] += 3.0
    batch.qvel[0, :3] = data.qvel[[0, 2, 4]] = 1.5, 2.0, 3.0
    held, floating = [], []
    for _ in range(steps):
        batch.step(np.zeros((1, spec.model.nu)))
        mujoco.mj_step(free, data, spec.frame_skip)
        held.append(batch.qpos[0].copy())
        x, y, z, turned, sideways, pitch, yaw, *others = data.qpos
        np.testing.assert_allclose([y, sideways, yaw], 0.0, atol=1e-9)  # it stays in the plane of its own accord
        floating.append([x, z - free.qpos0[2], 2 * np.arctan2(pitch, turned), *others])
    return np.array(held), np.array(floating)


def test_an_ant_held_to_the_plane_flies_as_a_free_one():
    spec = load_robot(ANT)
    held, floating = thrown(spec, 8)
    np.testing.assert_allclose(held, floating, atol=1e-4)
    np.testing.assert_allclose(floating[-1, :3], [0.67, 3.03, 1.35], atol=0.01)  # it did fly and turn
    assert spec.torso_height == 0.75


DEFAULTS = ("<default>", '<default><joint damping="2" armature="1" {more}/>')


def test_what_a_model_says_of_its_joints_does_not_hold_it_to_the_plane(write_own):
    old, new = DEFAULTS
    held, floating = thrown(load_robot(write_own(mjcf=[(old, new.format(more=""))])), 8)
    np.testing.assert_allclose(held, floating, atol=2e-3)


@pytest.mark.parametrize("more", ['stiffness="30"', 'frictionloss="5"'])
def test_no_spring_and_no_friction_holds_it_to_the_plane(write_own, more):
    old, new = DEFAULTS
    held, floating = thrown(load_robot(write_own(mjcf=[(old, new.format(more=more))])), 8)
    np.testing.assert_allclose(held, floating, atol=2e-3)


def test_an_ant_reads_out_relative_to_its_rest_pose():
    spec = load_robot(ANT)
    batch = batch_of(spec, 2)
    batch.qpos[:] = spec.model.qpos0
    state = spec.observe(batch.qpos + np.eye(1, spec.model.nq, 1) * 0.2, batch.qpos)
    np.testing.assert_allclose([state.x, state.z, state.vz], np.outer([0.0, 0.2, 2.0], [1, 1]), atol=1e-6)
    assert batch.joint_state().shape == (2, 2 + 8 + 3 + 8)
