"""Rest poses by keyframe, and models whose files are not all there."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.attitude import about_z, product
from rebody.bodies.check import check_robot
from rebody.cli.main import run
from rebody.errors import RebodyError
from rebody.types import GLOBAL_FIELDS

FREE = ('body = "trunk"', 'body = "trunk"\nspace = "free"')
CROUCH = ("frame_skip = 5", 'frame_skip = 5\nkeyframe = "crouch"')
KEYS = (
    "</mujoco>",
    '<keyframe><key name="high" qpos="0 0 2 1 0 0 0 0"/>'
    '<key name="crouch" qpos="3 4 0.4 0.8 0 0 0.6 0.7"/><key name="empty"/></keyframe></mujoco>',
)
BOX = '<geom type="box" size="0.3 0.1 0.1"/>'
MAKERS = Path(__file__).parents[2] / ".." / "shared" / "makers"


# keyframes


def test_a_free_robot_rests_as_its_keyframe_says(write_own):
    spec = replace(load_robot(write_own([FREE, CROUCH], [KEYS])), reset_noise=0.0)
    np.testing.assert_allclose(spec.rest_qpos, [3, 4, 0.4, 0.8, 0, 0, 0.6, 0.7])
    assert spec.torso_height == pytest.approx(0.4)
    batch = RobotBatch(spec, 2, threads=1)
    batch.reset(np.random.default_rng(0))
    np.testing.assert_allclose(batch.qpos, [[0, 0, 0.4, 0.8, 0, 0, 0.6, 0.7]] * 2)
    np.testing.assert_allclose(batch.observe().select(GLOBAL_FIELDS), 0.0, atol=1e-7)


def test_of_a_root_in_the_plane_the_height_alone_counts(write_own):
    spec = load_robot(write_own([CROUCH], [KEYS]))
    np.testing.assert_allclose(spec.rest_qpos, [0.0, -0.1, 0.0, 0.7])
    assert spec.torso_height == pytest.approx(0.4)


def test_joints_go_before_the_keyframe(write_own):
    spec = load_robot(write_own([CROUCH, ("[fall]", "[rest]\nhip = -0.2\n[fall]")], [KEYS]))
    np.testing.assert_allclose(spec.rest_qpos, [0.0, -0.1, 0.0, -0.2])


def test_a_body_before_the_robot_keeps_its_place_in_the_keyframe(write_own):
    toy = (
        '<body name="trunk"',
        '<body name="toy" pos="1 0 0.1"><freejoint/><geom size="0.1"/></body><body name="trunk"',
    )
    key = ("</mujoco>", '<keyframe><key name="crouch" qpos="2 1 0.3 1 0 0 0 3 4 0.4 0 0 0 1 0.7"/></keyframe></mujoco>')
    spec = load_robot(write_own([CROUCH], [toy, key]))
    np.testing.assert_allclose(spec.rest_qpos, [2, 1, 0.3, 1, 0, 0, 0, 0, -0.1, 0, 0.7])


@pytest.mark.parametrize(
    ("name", "mjcf", "says"),
    [
        ("crouched", [KEYS], r"no keyframe 'crouched'; those are 'high', 'crouch', 'empty'\. Did you mean 'crouch'\?"),
        ("crouch", [], "no keyframe 'crouch'; it has none"),
        ("empty", [KEYS], r"keyframe 'empty' says nothing of joint positions"),
        ("high", [(KEYS[0], KEYS[1].replace("0 0 2 1 0", "0 0 2 1"))], "keyframe 'high' has 7 joint positions"),
    ],
)
@pytest.mark.parametrize("root", [[], [FREE]], ids=["plane", "free"])
def test_a_keyframe_that_cannot_be_had(write_own, root, name, mjcf, says):
    spec = load_robot(write_own([*root, (CROUCH[0], CROUCH[1].replace("crouch", name))], mjcf))
    with pytest.raises(RebodyError, match=says):
        _ = spec.model


# files that are not there

ASSETS = (
    "<worldbody>",
    '<asset><mesh name="shell" file="shell.stl"/><texture name="skin" type="2d" file="skin.png"/>'
    '<material name="skin" texture="skin"/></asset><worldbody>',
)
SHELL = '<geom name="hull" type="mesh" mesh="shell" {more}/>'
SEEN = 'contype="0" conaffinity="0" mass="0"'


def dressed(more):
    """With a mesh, and a box that has a texture."""
    return [ASSETS, (BOX, SHELL.format(more=more) + BOX.replace("type", 'material="skin" type'))]


def test_what_only_draws_is_left_out_with_a_note(write_own, capsys):
    plain = load_robot(write_own())
    assert plain.model.body_mass.sum() > 0
    spec = load_robot(path := write_own(mjcf=dressed(SEEN)))
    assert (spec.model.ngeom, spec.model.nmesh, spec.model.ntex) == (plain.model.ngeom, 0, 0)
    np.testing.assert_array_equal(spec.model.body_mass, plain.model.body_mass)
    assert spec.compiled.left_out == ("shell.stl", "skin.png")
    first = check_robot(spec)[0]
    assert (first.subject, first.is_right) == ("files", True)
    assert first.says.endswith("shell.stl, skin.png")
    assert run(["robot", "check", path]) == 0
    assert "left out of the picture" in capsys.readouterr().out
    assert plain.compiled.left_out == ()


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ("", "touches things with it"),
        ('conaffinity="0"', "touches things with it"),
        ('contype="0" conaffinity="0"', "gives its body weight by it"),
        ('contype="0" conaffinity="0" density="0" mass="0.5"', "gives its body weight by it"),
    ],
)
def test_what_touches_or_weighs_is_needed(write_own, more, says):
    spec = load_robot(write_own(mjcf=dressed(more)))
    with pytest.raises(RebodyError, match=rf"robot 'own': the file 'shell.stl' is not there, and geom 'hull'.*{says}"):
        _ = spec.model


def test_files_that_are_there_are_kept(write_own, tmp_path):
    (tmp_path / "shell.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    spec = load_robot(write_own(mjcf=[(old, new.replace("shell.stl", "shell.obj")) for old, new in dressed(SEEN)]))
    assert spec.model.nmesh == 1
    assert spec.compiled.left_out == ("skin.png",)


# a maker's own

MAKER = """
mjcf = "{mjcf}"
frame_skip = {frame_skip}
keyframe = "{keyframe}"

[root]
body = "{body}"
space = "free"

[fall]
min_up = 0.5

[reach]
speed = [-1.0, 1.0]
"""
ROBOTS = {
    "go1": ("home", "trunk", 5, 12),
    "g1": ("knees_bent", "pelvis", 10, 29),
    "t1": ("home", "Trunk", 10, 23),
    "berkeley_humanoid": ("home", "torso", 10, 12),
}


@pytest.mark.skipif(not MAKERS.exists(), reason="the makers' models are not here")
@pytest.mark.parametrize("name", ROBOTS)
def test_a_makers_robot_whose_pictures_are_missing(name, tmp_path):
    keyframe, body, frame_skip, joints = ROBOTS[name]
    mjcf = (MAKERS / name / "scene_mjx_feetonly_flat_terrain.xml").resolve()
    path = tmp_path / f"{name}.toml"
    path.write_text(MAKER.format(mjcf=mjcf, frame_skip=frame_skip, keyframe=keyframe, body=body))
    spec = load_robot(str(path))
    assert (spec.model.nu, spec.steps_per_decision, spec.model.nmesh) == (joints, 5, 0)
    assert spec.compiled.left_out
    batch = RobotBatch(spec, 3, threads=1)
    batch.reset(np.random.default_rng(0))
    for _ in range(5):
        batch.step(np.zeros((3, joints)))
    assert np.isfinite(batch.observe().select(GLOBAL_FIELDS)).all()
    assert np.isfinite(batch.joint_state()).all()
    turned = batch.qpos.copy()
    turned[:, 3:7] = product(about_z(np.array(1.0)), turned[:, 3:7])
    moving = batch.qvel.copy()
    velocity = (moving[:, 0] + 1j * moving[:, 1]) * np.exp(1j)
    moving[:, 0], moving[:, 1] = velocity.real, velocity.imag
    np.testing.assert_allclose(spec.pose(turned)[:, 5], spec.pose(batch.qpos)[:, 5] + 1.0, atol=1e-9)
    np.testing.assert_allclose(spec.joint_state(turned, moving), batch.joint_state(), atol=1e-5)
