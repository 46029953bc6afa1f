"""What a walking policy hears, term by term, against MuJoCo's own sensors and by hand."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.walking import CART, write_linear

from rebody.bodies.walking import Joystick, Walking
from rebody.bodies.walking.joints import JointInterface
from rebody.bodies.walking.policy import WalkingPolicy
from rebody.bodies.walking.settings import Phase
from rebody.errors import RebodyError
from rebody.ranges import Box

STICK = Joystick(Box((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)))
MODEL = mujoco.MjModel.from_xml_string(CART)
REST = np.array([0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.3, -0.2])
ROOT = MODEL.body("chassis").id
COMMAND = np.array([[0.4, -0.1, 0.7]])


def policy_of(folder: Path, inputs, numbers, *, metadata=None, **settings) -> WalkingPolicy:
    """One whose two actions are the first two numbers that it hears."""
    path = write_linear(folder / "policy.onnx", np.eye(numbers)[:, :2], metadata=metadata)
    return WalkingPolicy("cart", Walking(path, STICK, inputs=inputs, **settings), MODEL, REST, ROOT)


def heard(policy, qpos, qvel, command=COMMAND, steps=1):
    """All that it hears at the last of some steps."""
    gait = policy.begin(len(qpos))
    for _ in range(steps):
        policy.step(gait, qpos, qvel, command, 0.02)
    return gait.heard[:, -1]


@pytest.fixture(scope="module")
def moving():
    """A cart in any attitude that moves in any way, in MuJoCo's own words."""
    rng = np.random.default_rng(0)
    data = mujoco.MjData(MODEL)
    data.qpos[:] = [1.0, -2.0, 0.7, *rng.normal(size=4), 0.5, 0.9]
    mujoco.mj_normalizeQuat(MODEL, data.qpos)
    data.qvel[:] = rng.normal(size=MODEL.nv)
    mujoco.mj_forward(MODEL, data)
    return data


def test_the_imu_feels_what_mujocos_sensors_feel(moving, tmp_path):
    policy = policy_of(tmp_path, ("linear_velocity", "angular_velocity", "gravity"), 9, imu="imu")
    numbers = heard(policy, moving.qpos[None], moving.qvel[None])[0]
    velocimeter, gyro = np.split(moving.sensordata, 2)
    down = moving.site("imu").xmat.reshape(3, 3).T @ [0.0, 0.0, -1.0]
    np.testing.assert_allclose(numbers, np.concatenate([velocimeter, gyro, down]), atol=1e-9)


def test_without_an_imu_the_body_feels(moving, tmp_path):
    policy = policy_of(tmp_path, ("angular_velocity", "gravity", "height"), 7)
    numbers = heard(policy, moving.qpos[None], moving.qvel[None])[0]
    down = moving.body("chassis").xmat.reshape(3, 3).T @ [0.0, 0.0, -1.0]
    np.testing.assert_allclose(numbers, [*moving.qvel[3:6], *down, 0.7], atol=1e-9)


def test_joints_are_heard_from_the_rest_pose_in_the_order_asked_for(moving, tmp_path):
    inputs = ("joint_positions", "joint_velocities", "command")
    policy = policy_of(tmp_path, inputs, 7, joints=("right", "left"), scales=(("command", 2.0),))
    numbers = heard(policy, moving.qpos[None], moving.qvel[None])[0]
    expected = [0.9 + 0.2, 0.5 - 0.3, moving.qvel[7], moving.qvel[6], *2 * COMMAND[0]]
    np.testing.assert_allclose(numbers, expected, atol=1e-9)
    np.testing.assert_array_equal(policy.joints.actuators, [1, 0])
    deaf = policy_of(tmp_path, inputs, 7, unheard=("left",))
    np.testing.assert_allclose(
        heard(deaf, moving.qpos[None], moving.qvel[None])[0][:4], [0.0, 1.1, 0.0, moving.qvel[7]], atol=1e-9
    )


def test_targets_are_scaled_actions_around_the_rest_pose(moving, tmp_path):
    for scale, expected in ((0.5, [0.3 + 0.2, -0.2 - 0.05]), ((1.0, 2.0), [0.3 + 0.4, -0.2 - 0.2])):
        policy = policy_of(tmp_path, ("command",), 3, action_scale=scale)
        targets = policy.step(policy.begin(1), moving.qpos[None], moving.qvel[None], COMMAND, 0.02)
        np.testing.assert_allclose(targets[0], expected, atol=1e-6)
    clipped = policy_of(tmp_path, ("command",), 3, action_clip=0.05)
    targets = clipped.step(clipped.begin(1), moving.qpos[None], moving.qvel[None], COMMAND, 0.02)
    np.testing.assert_allclose(targets[0], [0.35, -0.25], atol=1e-6)


def test_it_hears_its_last_action(moving, tmp_path):
    policy = policy_of(tmp_path, ("command", "last_action"), 5)
    one = heard(policy, moving.qpos[None], moving.qvel[None])
    two = heard(policy, moving.qpos[None], moving.qvel[None], steps=2)
    np.testing.assert_allclose([one[0, 3:], two[0, 3:]], [[0.0, 0.0], COMMAND[0, :2]], atol=1e-6)


def test_a_gait_has_a_clock_that_may_stop_at_rest(moving, tmp_path):
    policy = policy_of(tmp_path, ("phase",), 4, phase=Phase(1.5, at_rest=np.pi))
    np.testing.assert_allclose(heard(policy, moving.qpos[None], moving.qvel[None])[0], [1, -1, 0, 0], atol=1e-7)
    angle = 2 * np.pi * 1.5 * 0.02 * 10
    expected = [np.cos(angle), np.cos(angle + np.pi), np.sin(angle), np.sin(angle + np.pi)]
    np.testing.assert_allclose(heard(policy, moving.qpos[None], moving.qvel[None], steps=11)[0], expected, atol=1e-7)
    still = heard(policy, moving.qpos[None], moving.qvel[None], np.zeros((1, 3)), steps=11)
    np.testing.assert_allclose(still[0], [-1, -1, 0, 0], atol=1e-7)


def test_a_history_is_told_term_by_term_the_oldest_first(moving, tmp_path):
    path = write_linear(tmp_path / "policy.onnx", np.eye(8)[:, :2])
    walking = Walking(path, STICK, inputs=("command", "height"), history=2)
    policy = WalkingPolicy("cart", walking, MODEL, REST, ROOT)
    gait = policy.begin(1)
    policy.step(gait, moving.qpos[None], moving.qvel[None], COMMAND, 0.02)
    policy.step(gait, moving.qpos[None], moving.qvel[None], 2 * COMMAND, 0.02)
    np.testing.assert_allclose(policy.joints._stacked(gait.heard)[0], [*COMMAND[0], *2 * COMMAND[0], 0.7, 0.7])


def test_what_mjlab_writes_is_read_from_the_file(moving, tmp_path):
    metadata = {
        "observation_names": "base_ang_vel,projected_gravity,command",
        "joint_names": json.dumps(["right", "left"]),
        "default_joint_pos": "0.1,0.2",
        "action_scale": "0.5,0.25",
        "joint_stiffness": "20,30",
        "joint_damping": "1,2",
    }
    policy = policy_of(tmp_path, (), 9, metadata=metadata)
    gait = policy.begin(1)
    targets = policy.step(gait, moving.qpos[None], moving.qvel[None], COMMAND, 0.02)
    np.testing.assert_allclose(gait.heard[0, -1, :3], moving.qvel[3:6], atol=1e-9)
    np.testing.assert_allclose(targets[0], [0.1 + 0.5 * moving.qvel[3], 0.2 + 0.25 * moving.qvel[4]], atol=1e-6)
    model = mujoco.MjModel.from_xml_string(CART)
    policy.joints.drive(model)
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], [30.0, 20.0])
    np.testing.assert_array_equal(model.actuator_biasprm[:, :3], [[0.0, -30.0, -2.0], [0.0, -20.0, -1.0]])


def test_what_holosoma_writes_is_read_too(tmp_path):
    metadata = {"dof_names": json.dumps(["right", "left"]), "kp": "[20, 30]", "kd": "[1, 2]"}
    policy = policy_of(tmp_path, ("command",), 3, metadata=metadata)
    model = mujoco.MjModel.from_xml_string(CART)
    policy.joints.drive(model)
    np.testing.assert_array_equal(policy.joints.actuators, [1, 0])
    np.testing.assert_array_equal(model.actuator_gainprm[:, 0], [30.0, 20.0])
    np.testing.assert_array_equal(model.actuator_biasprm[:, 2], [-2.0, -1.0])


def test_motors_become_servos_as_strong_as_they_were(tmp_path):
    """A motor's range limits its torque; a servo's, which was an angle, does not. Twice is as once."""
    motors = CART.replace('<velocity name="left" joint="left" kv="2"', '<motor name="left" joint="left" gear="-3"')
    model = mujoco.MjModel.from_xml_string(motors)
    for _ in range(2):
        policy_of(tmp_path, ("command",), 3, stiffness=(1e6, 1e6), damping=(1.0, 1.0)).joints.drive(model)
    data = mujoco.MjData(model)
    data.ctrl[:] = 1.0
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_actuator[[6, 7]], [90.0, 1e6])


def test_a_motor_as_a_servo_pulls_with_its_gains_up_to_its_strength():
    arm = """
    <mujoco><worldbody><body name="trunk"><freejoint/><geom size="0.1"/>
      <body name="arm"><joint name="elbow" axis="0 1 0"/><geom size="0.1" pos="0.3 0 0"/></body>
    </body></worldbody><actuator>
      <motor joint="elbow" gear="150" ctrlrange="-0.5 1"/>
    </actuator></mujoco>"""
    model = mujoco.MjModel.from_xml_string(arm)
    walking = Walking(None, STICK, inputs=("command",), stiffness=(40.0,), damping=(2.0,))
    joints = JointInterface("arm", walking, model, model.qpos0, 1, {})
    assert joints.gains_in(model) == ([], [])
    joints.drive(model)
    assert joints.gains_in(model) == ([40.0], [2.0])
    data = mujoco.MjData(model)
    for target, speed, expected in ((1.0, 0.0, 40.0), (1.0, 5.0, 30.0), (9.0, 0.0, 150.0), (-9.0, 0.0, -75.0)):
        data.ctrl[:], data.qvel[6] = target, speed
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qfrc_actuator[6], expected)


@pytest.mark.parametrize(
    ("inputs", "numbers", "settings", "says"),
    [
        (("command", "gravity"), 5, {}, r"hears 5 numbers, the description says 6 \(command 3, gravity 3\)"),
        (
            ("command",),
            3,
            {"joints": ("left", "middle")},
            r"no actuator moves a joint 'middle' \(those are left, right\)",
        ),
        (("command",), 3, {"joints": ("left",)}, "it gives 2 numbers for 1 joints"),
        (("command",), 3, {"imu": "head"}, "no site 'head' for its IMU"),
        (("phase",), 3, {}, "it hears a phase"),
        (("command",), 3, {"stiffness": (1.0,)}, "must be 2 numbers each"),
        ((), 3, {}, "names no inputs"),
        ((), 3, {"metadata": {"observation_names": "base_lin_vel,height_scan"}}, "names an input 'height_scan'"),
        (
            (),
            3,
            {"metadata": {"observation_names": "command", "observation_terms_clip": "-1;1"}},
            "its file clips single inputs",
        ),
        (
            (),
            6,
            {"metadata": {"observation_names": "command,actions", "observation_terms_history_length": "2,0"}},
            r"histories of different lengths \(1, 2\)",
        ),
        (
            (),
            3,
            {"metadata": {"observation_names": "command", "observation_terms_scale": "1;2"}},
            "command is 3 numbers, and its scale is 2",
        ),
        (("command",), 3, {"metadata": {"kp": "1,2,3"}}, "its file says 3 numbers of joint_stiffness for 2 joints"),
        (("phase_sine",), 3, {}, "it hears a phase"),
    ],
)
def test_what_does_not_fit(tmp_path, inputs, numbers, settings, says):
    with pytest.raises(RebodyError, match=f"robot 'cart': its walking policy .* does not fit: .*{says}"):
        policy_of(tmp_path, inputs, numbers, **settings)
