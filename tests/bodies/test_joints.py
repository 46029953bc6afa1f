"""Joints with more than one degree of freedom, rest poses of one's own, and time steps that do not fit."""

from dataclasses import replace

import numpy as np
import pytest

from rebody.bodies import RobotBatch, load_robot
from rebody.errors import RebodyError

BALL = [('<joint name="hip" axis="0 1 0" damping="1"/>', '<joint name="hip" type="ball"/>')]
TOY = ("</worldbody>", '<body name="toy" pos="1 0 0.1"><freejoint/><geom size="0.1"/></body></worldbody>')


@pytest.fixture
def round_joints(write_own):
    """x, z, pitch, a ball joint, and a second body that floats freely."""
    return load_robot(write_own(mjcf=[*BALL, TOY]))


def test_velocities_are_scaled_by_degree_of_freedom(round_joints):
    model = round_joints.model
    assert (model.nq, model.nv) == (3 + 4 + 7, 3 + 3 + 6)
    velocities = round_joints.joint_state(model.qpos0, np.ones(model.nv))[model.nq - 1 :]
    np.testing.assert_allclose(velocities, [1, 1, 0.1, *3 * [0.1], *3 * [1], *3 * [0.1]])


def test_a_body_beside_the_robot_is_seen_from_the_robot(round_joints):
    qpos = round_joints.model.qpos0.copy()
    qpos[[0, 7]] += 40.0
    still = np.zeros(round_joints.model.nv)
    seen = round_joints.joint_state(qpos, still)
    np.testing.assert_array_equal(seen, round_joints.joint_state(round_joints.model.qpos0, still))
    assert seen[6] == 1.0


def test_an_orientation_is_one_quaternion(round_joints):
    qpos, still = round_joints.model.qpos0.copy(), np.zeros(round_joints.model.nv)
    qpos[3:7], qpos[10:14] = [-0.6, 0.8, 0.0, 0.0], [0.6, 0.0, 0.8, 0.0]
    seen = round_joints.joint_state(qpos, still)
    np.testing.assert_allclose(seen[2:6], [0.6, -0.8, 0.0, 0.0])
    np.testing.assert_allclose(seen[9:13], [0.6, 0.0, 0.8, 0.0])


def test_orientations_begin_as_unit_quaternions(round_joints):
    batch = RobotBatch(replace(round_joints, reset_noise=0.3), 5, threads=1)
    batch.reset(np.random.default_rng(0))
    for first in (3, 10):
        np.testing.assert_allclose(np.linalg.norm(batch.qpos[:, first : first + 4], axis=-1), 1.0)
    assert batch.qpos[:, 4].std() > 0.05


def test_a_rest_pose_of_ones_own_is_where_a_reset_puts_it(write_own):
    spec = load_robot(write_own([("[fall]", "[rest]\nrebody-z = 0.25\nhip = 0.5\n[fall]")]))
    batch = RobotBatch(replace(spec, reset_noise=0.0), 2, threads=1)
    batch.reset(np.random.default_rng(0))
    np.testing.assert_array_equal(batch.qpos, [[0.0, 0.25, 0.0, 0.5]] * 2)
    assert spec.torso_height == 0.75
    assert not spec.observe(batch.qpos, batch.qpos).z.any()


@pytest.mark.parametrize("joint", ["knee", "ball"])
def test_a_rest_pose_of_what_is_no_slide_or_hinge_is_refused(joint, write_own):
    spec = load_robot(
        write_own(
            [("[fall]", f"[rest]\n{joint} = 0.5\n[fall]")],
            [(BALL[0][0], '<joint name="ball" type="ball"/>'), ('joint="hip"', 'joint="ball"')],
        )
    )
    with pytest.raises(RebodyError, match=rf"\[rest\] names '{joint}', which is no slide or hinge.*rebody-pitch\."):
        _ = spec.rest_qpos


@pytest.mark.parametrize(
    ("frame_skip", "timestep", "says"),
    [
        (3, 0.01, r"0\.03 s does not divide a decision of 0\.1 s .*Choose frame_skip = 1, 2, 5 or 10\."),
        (5, 0.003, r"set timestep = 0\.0025 in its TOML file and frame_skip = 2, 4, 5, 8, 10, 20 or 40\."),
        (1, 0.2, r"set timestep = 0\.1 in its TOML file and frame_skip = 1\."),
        (1, 1e-9, "its time step is 1e-09 s, and must be at least 1e-05 s"),
    ],
)
def test_what_would_divide_a_decision_is_said(frame_skip, timestep, says, cheetah):
    with pytest.raises(RebodyError, match=says):
        _ = replace(cheetah, frame_skip=frame_skip, timestep=timestep).steps_per_decision
