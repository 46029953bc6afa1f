"""`rebody robot check`: sound robots pass, and each defect is found and named."""

import re
from dataclasses import replace

import mujoco
import pytest
from tests.walking import CART, CART_TOML, write_cart

from rebody.bodies import check, load_robot
from rebody.bodies.check import check_robot
from rebody.bodies.robot import Fall
from rebody.cli.main import run

STANDING = 'inputs = ["command"]\naction_scale = 0.0\nstiffness = [1.0, 1.0]\ndamping = [0.1, 0.1]'


@pytest.fixture(autouse=True)
def in_short(monkeypatch):
    monkeypatch.setattr(check, "SECONDS", 0.5)


def wrong(spec):
    return {finding.subject: finding.says for finding in check_robot(spec) if not finding.is_right}


@pytest.mark.parametrize("name", ["cheetah", "hopper", "walker"])
def test_shipped_robots_are_sound(name):
    assert wrong(load_robot(name)) == {}


def test_a_fall_while_it_does_nothing_is_no_defect():
    says = {finding.subject: finding.says for finding in check_robot(load_robot("hopper"))}
    assert "fallen after" in says["moves at random"]


def test_a_robot_that_walks_already_is_moved_by_its_stick(tmp_path):
    """Its motors at random would throw it away; its policy's gains do not."""
    pytest.importorskip("onnxruntime")
    description = write_cart(tmp_path, CART_TOML.replace('inputs = ["command"]', STANDING))
    motors = re.sub(r"<velocity (.*) kv=.*/>", r'<motor \1 ctrlrange="-1e9 1e9"/>', CART)
    assert motors.count("<motor") == 2
    (tmp_path / "cart.xml").write_text(motors)
    assert wrong(load_robot(str(description))) == {}


def test_a_control_step_that_does_not_fit():
    assert "does not divide a decision" in wrong(replace(load_robot("hopper"), frame_skip=7))["control step"]


def test_joints_that_are_not_there_or_turn_the_wrong_way():
    spec = load_robot("hopper")
    missing = wrong(replace(spec, root=("rootx", "roots", "rooty")))
    assert "no joint 'roots'; its joints are rootx, rootz, rooty, thigh_joint" in missing["z"]
    swapped = wrong(replace(spec, root=("rootx", "rooty", "rootz")))
    assert swapped.keys() == {"z", "pitch"}
    assert "is no slide along z" in swapped["z"]


def test_a_rest_pose_that_counts_as_fallen():
    says = wrong(replace(load_robot("walker"), fall=Fall(min_height=2.0)))["rest pose"]
    assert "counts as fallen, see [fall]" in says


@pytest.mark.parametrize(
    ("actuator", "says"), [("", "the model has none"), ('<motor joint="x" name="push"/>', "no ctrlrange: push")]
)
def test_actuators(actuator, says, tmp_path):
    joints = "".join(
        f'<joint name="{name}" type="{kind}" axis="{axis}"/>'
        for name, kind, axis in (("x", "slide", "1 0 0"), ("z", "slide", "0 0 1"), ("p", "hinge", "0 1 0"))
    )
    (tmp_path / "box.xml").write_text(
        f'<mujoco><worldbody><geom type="plane" size="9 9 1"/><body pos="0 0 .2">{joints}<geom size=".1"/></body>'
        f"</worldbody><actuator>{actuator}</actuator></mujoco>"
    )
    (tmp_path / "box.toml").write_text(
        'mjcf = "box.xml"\nframe_skip = 10\n[root]\nx = "x"\nz = "z"\npitch = "p"\n[fall]\n[reach]\n'
        "speed = [-1.0, 1.0]\n"
    )
    assert says in wrong(load_robot(str(tmp_path / "box.toml")))["actuators"]


def test_the_command(capsys, tmp_path):
    assert run(["robot", "check", "hopper"]) == 0
    assert "ready: rebody train tracker hopper" in capsys.readouterr().out
    (tmp_path / "slow.toml").write_text(
        'mjcf = "gymnasium:hopper.xml"\nframe_skip = 7\n[root]\nx = "rootx"\nz = "rootz"\npitch = "rooty"\n'
        "[fall]\n[reach]\nspeed = [-1.0, 1.0]\n"
    )
    assert run(["robot", "check", str(tmp_path / "slow.toml")]) == 2
    assert "robot 'slow' is not ready: see control step" in capsys.readouterr().err


JOINTS = (
    '<joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/>'
    '<joint name="p" axis="0 1 0"/>'
)
NAMED = [('body = "trunk"', 'x = "x"\nz = "z"\npitch = "p"')], [("<freejoint/>", JOINTS)]


def test_an_own_robot_is_sound(write_own):
    assert wrong(load_robot(write_own())) == {}
    assert wrong(load_robot(write_own(*NAMED))) == {}


@pytest.mark.parametrize(
    ("old", "new", "field", "says"),
    [
        ('type="slide" axis="1 0 0"', 'type="slide" axis="-1 0 0"', "x", "'x' is no slide along x"),
        ('axis="0 0 1"', 'axis="0 1 1"', "z", "'z' is no slide along z"),
        ('axis="0 1 0"/><geom', 'axis="0 -1 0"/><geom', "pitch", "'p' is no hinge about y"),
    ],
)
def test_a_joint_along_another_axis(old, new, field, says, write_own):
    """Forward, up and nose down count positive."""
    toml, _ = NAMED
    bent = (JOINTS + "<geom").replace(old, new).removesuffix("<geom")
    assert bent != JOINTS
    found = wrong(load_robot(write_own(toml, [("<freejoint/>", bent)])))
    assert found.keys() == {field}
    assert says in found[field]


def test_a_simulation_that_runs_away_at_random_actions(write_own, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs it
    found = wrong(load_robot(write_own(mjcf=[('<motor name="muscle"', '<motor name="muscle" gear="1e7"')])))
    assert found.keys() == {"moves at random"}
    assert "diverged" in found["moves at random"]


UNSTABLE = ('damping="1"', 'stiffness="1e7" springref="40"')


def test_a_simulation_that_runs_away_by_itself(write_own, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo logs it
    assert wrong(load_robot(write_own(mjcf=[UNSTABLE]))).keys() >= {"does nothing", "moves at random"}


def test_positions_that_run_away_are_found_before_mujoco_gives_up(write_own, monkeypatch):
    monkeypatch.setattr(check, "FAR", 0.4)
    found = wrong(load_robot(write_own()))
    assert found["does nothing"] == "positions run away: lower the time step"


def test_a_push_forward_that_reads_backward(write_own):
    """A spring holds it, and brings it back within the decision."""
    toml, _ = NAMED
    tied = JOINTS.replace('axis="1 0 0"', 'axis="1 0 0" stiffness="53000"')
    found = wrong(load_robot(write_own(toml, [("<freejoint/>", tied)])))
    assert found.keys() == {"readout"}
    assert "it reads -0." in found["readout"]


def test_what_is_said_is_printed_as_it_is(write_own, capsys):
    assert run(["robot", "check", write_own([("max_pitch = 1.5", "min_height = 2.0")])]) == 2
    assert "[fall]" in capsys.readouterr().out


def test_a_trunk_that_is_turned_in_its_model_is_found_or_held_to_the_right_plane(write_own):
    spec = load_robot(write_own(mjcf=[('pos="0 0 0.5"', 'pos="0 0 0.5" euler="0 0 90"')]))
    data = mujoco.MjData(spec.model)
    data.qvel[spec.x_velocity_address] = 1.0
    mujoco.mj_forward(spec.model, data)
    mujoco.mj_subtreeVel(spec.model, data)
    assert wrong(spec) or data.subtree_linvel[0][0] > 0.9
