"""Robots that float freely in space: what is read of them is right in every direction and at every heading."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.attitude import about_z, positive, product, roll_pitch_yaw, up_axis
from rebody.bodies.check import check_robot
from rebody.bodies.robot import Fall
from rebody.errors import RebodyError
from rebody.types import GLOBAL_FIELDS

ANT = str(Path(__file__).parents[2] / "examples" / "ant" / "ant.toml")
FREE = [('body = "trunk"', 'body = "trunk"\nspace = "free"')]
TURNED = [('pos="0 0 0.5"', 'pos="0 0 0.5" euler="0 0 90"')]
BALL = [('<joint name="hip" axis="0 1 0" damping="1"/>', '<joint name="hip" type="ball"/>')]
BESIDE = [("</worldbody>", '<body name="toy" pos="1 0 0.1"><freejoint/><geom size="0.1"/></body></worldbody>')]
BEFORE = [
    ('<body name="trunk"', '<body name="toy" pos="1 0 0.1"><freejoint/><geom size="0.1"/></body><body name="trunk"')
]
QUARTER = np.pi / 2


@pytest.fixture
def free(write_own):
    """The one-legged robot, afloat and without noise."""
    return replace(load_robot(write_own(FREE)), reset_noise=0.0)


def fresh(spec, size=1):
    batch = RobotBatch(spec, size, threads=1)
    batch.reset(np.random.default_rng(0))
    return batch


def decide(batch):
    for _ in range(batch.steps_per_decision):
        batch.step(np.zeros((batch.size, batch.actions)))
    return batch.observe()


def numbers(state, *fields):
    return [float(getattr(state, field)[0]) for field in fields]


def about(axis, angle):
    turn = np.zeros(4)
    mujoco.mju_axisAngle2Quat(turn, np.array(axis, float), angle)
    return turn


def test_everything_can_move(free):
    assert free.moving_fields == GLOBAL_FIELDS
    assert free.joint_inputs == fresh(free).joint_state().shape[1] == 4 + 1 + 6 + 1


def test_at_rest_nothing_is_read_but_the_up_axis(free):
    batch = fresh(free)
    assert not batch.observe().select(GLOBAL_FIELDS).any()
    np.testing.assert_allclose(batch.joint_state()[0, :4], [0, 0, 0, 1], atol=1e-7)


def test_dropped_and_pushed_it_flies_as_newton_says(free):
    batch = fresh(free)
    batch.qpos[0, 2] += 5.0
    batch.place(0.0)  # it stands still there
    batch.push(np.array([[1.0, -2.0]]))
    state = decide(batch)
    fall = -9.81 * 0.01 * 0.01 * sum(range(1, 11))  # ten steps of semi-implicit Euler
    np.testing.assert_allclose(numbers(state, "x", "y", "vx", "vy"), [0.1, -0.2, 1.0, -2.0], atol=5e-3)
    np.testing.assert_allclose(numbers(state, "z", "vz"), [5.0 + fall, fall / 0.1], atol=5e-3)


def test_a_push_along_x_alone_leaves_y(free):
    batch = fresh(free, 2)
    batch.push(np.array([1.0, -1.0]))
    np.testing.assert_allclose(batch.qvel[:, :3], [[1, 0, 0], [-1, 0, 0]])


@pytest.mark.parametrize(
    ("axis", "field", "up"),  # about forward, left and up
    [((1, 0, 0), "roll", (0, 1)), ((0, 1, 0), "pitch", (-1, 0)), ((0, 0, 1), "yaw", (0, 0))],
)
def test_a_turn_about_each_axis_has_its_name(free, axis, field, up):
    batch = fresh(free)
    batch.qpos[0, 3:7] = about(axis, 0.4)
    state = batch.observe()
    assert numbers(state, field) == pytest.approx([0.4])
    assert numbers(state, f"{field}_rate") == pytest.approx([4.0])
    others = {"roll", "pitch", "yaw"} - {field}
    assert numbers(state, *others) == pytest.approx([0.0, 0.0], abs=1e-7)
    np.testing.assert_allclose(batch.joint_state()[0, 1:3], np.sin(0.4) * np.array(up), atol=1e-6)


def test_angles_are_those_of_a_turn_by_yaw_then_pitch_then_roll():
    yaw, pitch, roll = about((0, 0, 1), 2.0), about((0, 1, 0), -0.7), about((1, 0, 0), 3.0)
    found = roll_pitch_yaw(product(product(yaw, pitch), roll))
    np.testing.assert_allclose(found, [3.0, -0.7, 2.0])


def test_a_quaternion_and_its_negative_are_one_attitude(free):
    batch, twin = fresh(free), fresh(free)
    batch.qpos[0, 3:7] = product(about((0, 0, 1), 2.5), about((1, 0, 0), -1.0))
    twin.qpos[:] = batch.qpos
    twin.qpos[0, 3:7] *= -1
    one, other = batch.observe(), twin.observe()
    np.testing.assert_allclose(one.select(GLOBAL_FIELDS), other.select(GLOBAL_FIELDS), atol=1e-6)
    np.testing.assert_allclose(batch.joint_state(), twin.joint_state(), atol=1e-6)
    np.testing.assert_allclose(positive(-batch.qpos[0, 3:7])[0], abs(batch.qpos[0, 3]))


def test_a_heading_that_passes_behind_turns_by_little(free):
    """From just below pi to just above: 0.2 rad in 0.1 s, and not nearly a whole turn back."""
    batch = fresh(free)
    batch.place(0.0, yaw=np.pi - 0.1)
    batch.qpos[0, 3:7] = about_z(np.array(np.pi + 0.1))
    state = batch.observe()
    assert numbers(state, "yaw", "yaw_rate") == pytest.approx([-np.pi + 0.1, 2.0], abs=1e-5)


def tumbling(spec, rng):
    """In mid-air, moving and turning in every way."""
    batch = fresh(spec, 4)
    batch.qpos[:] += rng.uniform(-0.5, 0.5, batch.qpos.shape)
    for pose in batch.qpos:
        mujoco.mj_normalizeQuat(spec.model, pose)
    batch.qvel[:] = rng.normal(size=batch.qvel.shape)
    return batch


def turned_whole(spec, qpos, qvel, angle, by):
    """The whole world turned about z, and moved: every body that floats freely."""
    qpos, qvel, turn = qpos.copy(), qvel.copy(), about_z(np.array(angle))
    cos, sin = np.cos(angle), np.sin(angle)
    rotation = np.array([[cos, -sin], [sin, cos]])
    for joint in np.flatnonzero(spec.model.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
        first, velocity = spec.model.jnt_qposadr[joint], spec.model.jnt_dofadr[joint]
        qpos[:, first : first + 2] = qpos[:, first : first + 2] @ rotation.T + by
        qpos[:, first + 3 : first + 7] = product(turn, qpos[:, first + 3 : first + 7])
        qvel[:, velocity : velocity + 2] = qvel[:, velocity : velocity + 2] @ rotation.T
    return qpos, qvel


@pytest.mark.parametrize("mjcf", [[], TURNED, [*BALL, *BESIDE], BEFORE], ids=["alone", "turned", "beside", "before"])
@pytest.mark.parametrize("angle", [1.0, -2.9])
def test_the_joint_state_does_not_know_where_it_is_nor_heads(write_own, mjcf, angle):
    spec = load_robot(write_own(FREE, mjcf))
    batch = tumbling(spec, np.random.default_rng(1))
    qpos, qvel = turned_whole(spec, batch.qpos, batch.qvel, angle, [3.0, -7.0])
    seen = batch.joint_state()
    assert seen.shape[1] == spec.joint_inputs
    assert np.abs(seen).min(axis=0).max() > 0.01
    np.testing.assert_allclose(spec.joint_state(qpos, qvel), seen, atol=1e-5)
    yaw, now = spec.pose(batch.qpos)[:, 5], spec.pose(qpos)
    np.testing.assert_allclose(np.exp(1j * now[:, 5]), np.exp(1j * (yaw + angle)), atol=1e-9)
    np.testing.assert_allclose(now[:, 2:5], spec.pose(batch.qpos)[:, 2:5], atol=1e-9)


def test_a_trunk_that_is_turned_in_its_model_reads_as_one_that_is_not(write_own):
    """Forward is the world's x in the rest pose, whatever the trunk's own axes are."""
    spec = replace(load_robot(write_own(FREE, TURNED)), reset_noise=0.0)
    batch = fresh(spec)
    assert not batch.observe().select(GLOBAL_FIELDS).any()
    batch.qvel[0, 3:6] = [1.0, 0.0, 0.0]  # about its own x, which points to the left
    np.testing.assert_allclose(batch.joint_state()[0, -4:-1], [0.0, 0.1, 0.0], atol=1e-7)
    assert numbers(decide(batch), "pitch_rate")[0] > 0.3


def test_velocities_are_seen_from_the_heading(free):
    batch = fresh(free)
    batch.place(0.0, yaw=QUARTER)
    batch.push(np.array([[0.0, 2.0]]))  # the way it heads
    np.testing.assert_allclose(batch.joint_state()[0, 5:8], [2.0, 0.0, 0.0], atol=1e-6)
    batch = fresh(replace(free, smoothing_s=0.1))
    batch.place(0.0, yaw=QUARTER)
    batch.push(np.array([[0.0, 2.0]]))
    batch.step(np.zeros((1, 1)))
    assert batch.pace[0] == pytest.approx(0.5 * 2.0, abs=0.1)  # half of it after half the time constant
    assert batch.proprioception()[0, -1] == np.float32(batch.pace[0])


def test_placed_it_goes_on_as_it_was_from_there(free):
    batch, twin = fresh(free, 2), fresh(free, 2)
    for each in (batch, twin):
        each.push(np.array([[1.0, 0.5], [0.3, 0.0]]))
        decide(each)
    batch.place(2.0, y=-1.0, yaw=2.0, who=np.array([True, False]))
    np.testing.assert_allclose(batch.pose()[0, [0, 1, 5]], [2.0, -1.0, 2.0])
    np.testing.assert_allclose(batch.pose()[0, 2:5], twin.pose()[0, 2:5], atol=1e-9)
    np.testing.assert_allclose(batch.joint_state(), twin.joint_state(), atol=1e-6)
    np.testing.assert_array_equal(batch.pose()[1], twin.pose()[1])
    assert not batch.observe().vx[0]  # it counts as having stood still
    np.testing.assert_array_equal(batch.observe().vx[1], twin.observe().vx[1])
    batch.place(np.array([5.0, 6.0]))
    np.testing.assert_allclose(batch.pose()[:, :2], [[5.0, -1.0], [6.0, twin.pose()[1, 1]]])


def test_it_falls_on_its_side_and_on_its_back(free):
    spec = replace(free, fall=Fall(min_up=0.5))
    angles = np.array([0.0, 0.9, 1.2, np.pi])  # the limit is at 1.05
    for axis in ((1, 0, 0), (0, 1, 0)):
        qpos = np.tile(spec.rest_qpos, (4, 1))
        qpos[:, 3:7] = [product(about((0, 0, 1), 2.0), about(axis, angle)) for angle in angles]
        assert spec.lies(qpos).tolist() == [False, False, True, True]
        np.testing.assert_allclose(up_axis(qpos[:, 3:7])[:, 2], np.cos(angles), atol=1e-9)
    low = spec.rest_qpos - np.eye(spec.model.nq)[2] * 0.2
    assert replace(free, fall=Fall(min_height=0.4)).lies(low[None]).all()


def test_of_a_robot_in_the_plane_the_up_axis_leans_with_the_pitch(cheetah):
    qpos = np.zeros((3, 9))
    qpos[:, 2] = [0.9, -1.2, np.pi]
    assert replace(cheetah, fall=Fall(min_up=0.5)).lies(qpos).tolist() == [False, True, True]


def test_an_ant_afloat_moves_as_mujocos_and_is_sound():
    spec = replace(load_robot(ANT), space="free", reset_noise=0.0)
    data, batch = mujoco.MjData(spec.model), fresh(spec)
    data.qpos[:] = spec.rest_qpos
    rng = np.random.default_rng(0)
    for action in rng.uniform(-1, 1, (10, 1, batch.actions)):
        data.ctrl[:] = action[0]
        mujoco.mj_step(spec.model, data, spec.frame_skip)
        batch.step(action)
    np.testing.assert_array_equal(batch.qpos[0], data.qpos)
    assert all(finding.is_right for finding in check_robot(replace(spec, reset_noise=0.05)))


def test_the_check_covers_it(write_own):
    found = {finding.subject: finding for finding in check_robot(load_robot(write_own(FREE)))}
    assert all(finding.is_right for finding in found.values())
    assert found["root body"].says == "'trunk', floats freely in space"
    assert "forward it reads 0.9" in found["readout"].says
    assert "sideways it reads 0.9" in found["readout"].says
    assert "training" in found


def test_a_saved_state_holds_the_last_decision(free):
    """In the middle of one: what is observed at its end depends on where it began."""
    batch, twin = fresh(free, 2), fresh(free, 2)
    batch.push(np.array([[1.0, 0.0], [0.0, 1.0]]))
    batch.step(np.ones((2, 1)))
    twin.state = batch.state
    for each in (batch, twin):
        each.step(np.ones((2, 1)))
    assert np.abs(batch.observe().vx[0]) > 0.5
    np.testing.assert_array_equal(batch.observe().select(GLOBAL_FIELDS), twin.observe().select(GLOBAL_FIELDS))


def test_what_is_for_the_plane_alone_says_so(free):
    with pytest.raises(RebodyError, match="'own' floats freely; this is for robots in the plane"):
        _ = free.root_addresses


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('body = "trunk"', 'x = "a"\nz = "b"\npitch = "c"\nspace = "free"', "alone may have space"),
        ('body = "trunk"', 'body = "trunk"\nspace = "air"', "Invalid enum value 'air'"),
        ("max_pitch = 1.5", "min_up = 1.0", "min_up less than 1"),
        ("max_pitch = 1.5", "min_up = nan", "min_up less than 1"),
    ],
)
def test_a_file_that_cannot_be_meant(write_own, old, new, says):
    with pytest.raises(RebodyError, match=says):
        load_robot(write_own([(old, new)]))


def test_a_body_that_does_not_float_cannot_be_free(write_own):
    toml = [('body = "trunk"', 'body = "leg"\nspace = "free"')]
    with pytest.raises(RebodyError, match="no body 'leg' that floats freely"):
        _ = load_robot(write_own(toml)).model
