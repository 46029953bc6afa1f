"""Robots from TOML files: the shipped ones, one's own, and what is said of a bad file."""

from pathlib import Path

import numpy as np
import pytest
from tests.walking import robot_that_is_there

from rebody.bodies import RobotBatch, load_robot, shipped_robots
from rebody.bodies.robot import Fall
from rebody.errors import RebodyError
from rebody.names import ROBOTS
from rebody.ranges import Box, interval

ANT = Path(__file__).parents[2] / "examples" / "ant" / "ant.toml"


def test_these_robots_are_shipped():
    assert shipped_robots() == ("ant", "berkeley", "cheetah", "go1", "hopper", "quadruped", "walker")


@pytest.mark.parametrize("name", [*shipped_robots(), str(ANT)])
def test_a_described_robot_can_be_used(name):
    spec = robot_that_is_there(name)
    assert spec.name == Path(name).stem
    assert spec.steps_per_decision * spec.control_dt == pytest.approx(0.1)
    speed = next(box for family, box in spec.reach if family.startswith("velocity"))
    assert speed.low[0] < 0 < speed.high[0]
    batch = RobotBatch(spec, 2, threads=1)
    batch.reset(np.random.default_rng(0))
    batch.step(np.zeros((2, spec.model.nu)))
    assert not batch.fallen.any()


def test_a_file_may_begin_with_a_byte_order_mark(tmp_path):
    text = (ROBOTS / "hopper.toml").read_text(encoding="utf-8")
    (tmp_path / "hopper.toml").write_text(text, encoding="utf-8-sig")
    assert load_robot(str(tmp_path / "hopper.toml")) == load_robot("hopper")


@pytest.mark.parametrize("name", ["hopper", "walker"])
def test_those_that_balance_decide_after_five_steps_of_20_ms(name):
    spec = load_robot(name)
    assert spec.control_dt == pytest.approx(0.02)
    assert spec.steps_per_decision == 5


@pytest.mark.parametrize(("name", "lowest", "steepest"), [("hopper", 0.7, 0.7), ("walker", 0.8, 1.0)])
def test_those_that_balance_fall_when_low_or_aslant(name, lowest, steepest):
    """At once; the height is that of the torso in the world."""
    spec = load_robot(name)
    batch = RobotBatch(spec, 7, threads=1)
    batch.reset(np.random.default_rng(0))
    batch.qpos[:] = spec.model.qpos0
    _, z, pitch = spec.root_addresses
    batch.qpos[:, z] = [1.25, lowest + 0.01, lowest - 0.01, 1.25, 1.25, 1.25, 1.25]
    batch.qpos[:, pitch] = [0, 0, 0, steepest - 0.01, steepest + 0.01, -steepest + 0.01, -steepest - 0.01]
    expected = [False, False, True, False, True, False, True]
    assert spec.lies(batch.qpos).tolist() == expected
    batch.qvel[:] = 0
    batch.qpos[3:, z] = 2.0  # nothing touches the floor, so a step leaves the pitch as it is
    batch.step(np.zeros((7, spec.model.nu)))
    assert batch.fallen.tolist()[3:] == expected[3:]


def test_the_cheetah_falls_on_its_back_only_and_after_a_second(cheetah):
    assert cheetah.fall == Fall(max_pitch=2.0, lasts_s=1.0)
    assert dict(cheetah.reach)["stand"] == interval(-1.0472, 1.0472)


def test_an_own_robot_is_read_beside_its_model(write_own):
    spec = load_robot(write_own())
    assert (spec.name, spec.root, spec.frame_skip, spec.control_dt) == ("own", "trunk", 5, 0.05)
    assert spec.fall == Fall(max_pitch=1.5)
    assert spec.reach == (("velocity", interval(-1.0, 2.5)),)
    assert spec.reset_noise == 0.01
    assert spec.model.nu == 1
    assert spec.torso_height == 0.5


def test_every_setting_of_a_file_counts(write_own):
    path = write_own(
        [
            ("frame_skip = 5", "frame_skip = 10\nreset_noise = 0.2"),
            ("max_pitch = 1.5", "min_height = 0.2\nmax_pitch = 1.1\nlasts_s = 0.3"),
            ("velocity = [-1, 2.5]", "velocity = [-2, 2]\nlean = [[-7, 7], [-0.5, 0.4]]"),
        ]
    )
    spec = load_robot(path)
    assert (spec.frame_skip, spec.reset_noise) == (10, 0.2)
    assert spec.fall == Fall(min_height=0.2, max_pitch=1.1, lasts_s=0.3)
    assert spec.reach == (("velocity", interval(-2.0, 2.0)), ("lean", Box((-7.0, -0.5), (7.0, 0.4))))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("frame_skip = 5\n", "", "missing required field `frame_skip`"),
        ("velocity = [-1, 2.5]", "velocity = 3", r"Expected `array`, got `int` - at `\$\.reach"),
        ("velocity = [-1, 2.5]", "", r"\[reach\] names no family"),
        ("frame_skip = 5", "frame_skip = 5\ncolour = 'red'", "unknown field `colour`"),
        ("max_pitch", "max_roll", r"unknown field `max_roll` - at `\$\.fall`"),
        ("frame_skip = 5", "frame_skip = '5'", "Expected `int`, got `str`"),
        ("[-1, 2.5]", "[-1, 0, 2.5]", r"\[reach\] velocity: pairs of ends has shape \(1, 3\)"),
        ("frame_skip = 5", "frame_skip =", "is not a TOML file"),
        ('body = "trunk"', 'body = "trunk"\nx = "hip"', "either the joints that carry x, z and pitch, or the body"),
        ('body = "trunk"', 'x = "hip"\nz = "hip"', "either the joints that carry x, z and pitch, or the body"),
        ('body = "trunk"', "", "either the joints that carry x, z and pitch, or the body"),
        ("frame_skip = 5", "frame_skip = 0", "frame_skip must be at least 1"),
        ("frame_skip = 5", "frame_skip = 5\nreset_noise = -0.1", "reset_noise must not be negative"),
        ("frame_skip = 5", "frame_skip = 5\ntimestep = 0", "timestep must be positive"),
        ("frame_skip = 5", "frame_skip = 5\ntimestep = nan", "timestep must be positive"),
        ("[fall]", "[rest]\nhip = inf\n[fall]", r"\[rest\] positions must be finite"),
        ("[fall]", "[rest]\nhip = 'low'\n[fall]", "Expected `float`, got `str`"),
        ("max_pitch = 1.5", "max_pitch = 0", "max_pitch must be positive"),
        ("max_pitch = 1.5", "lasts_s = -1", "lasts_s not negative"),
        ("[-1, 2.5]", "[2.5, -1]", r"\[reach\] velocity: from \[2\.5\] to \[-1\.0\] there is nothing"),
        ("[-1, 2.5]", "[nan, 1]", "is nan; give a finite number"),
        ("[reach]", "[reach]\nlean = [[-7, 7], [1, 0]]", r"\[reach\] lean: from \[-7\.0, 1\.0\] to \[7\.0, 0\.0\]"),
    ],
)
def test_a_bad_file_is_named_with_what_is_wrong(write_own, old, new, says):
    path = write_own([(old, new)])
    with pytest.raises(RebodyError, match=says) as raised:
        load_robot(path)
    assert path in str(raised.value)


def test_all_that_is_out_of_range_is_said_at_once(write_own):
    path = write_own([("frame_skip = 5", "frame_skip = 0\ntimestep = 0")])
    with pytest.raises(RebodyError, match=r"frame_skip must.*; .*timestep"):
        load_robot(path)


def test_a_missing_file_is_named(tmp_path):
    path = tmp_path / "own.toml"
    with pytest.raises(RebodyError, match=f"cannot read the robot's file '{path}'"):
        load_robot(str(path))
    path.mkdir()
    with pytest.raises(RebodyError, match=f"{path} is a folder"):
        load_robot(str(path))


def test_bytes_that_are_no_text_are_no_toml(tmp_path):
    path = tmp_path / "picture.toml"
    path.write_bytes(b"\x89PNG\xff")
    with pytest.raises(RebodyError, match=r"picture\.toml' is not a TOML file"):
        load_robot(str(path))


@pytest.mark.parametrize(
    ("toml", "mjcf", "says"),
    [
        ([("own.xml", "other.xml")], [], r"robot 'own': MuJoCo cannot read '.*other\.xml'"),
        ([("own.xml", "gymnasium:ants.xml")], [], r"robot 'own': MuJoCo cannot read '.*ants\.xml'"),
        ([], [("<worldbody>", "<worldbod>")], r"robot 'own': MuJoCo cannot read '.*own\.xml'"),
        ([], [('joint="hip"', 'joint="knee"')], r"robot 'own': MuJoCo cannot use '.*own\.xml'.*knee"),
        ([('"trunk"', '"torso"')], [], "robot 'own': its model has no body 'torso' that floats freely"),
        ([('"trunk"', '"leg"')], [], "robot 'own': its model has no body 'leg' that floats freely"),
    ],
)
def test_a_model_that_cannot_be_used_is_named(write_own, toml, mjcf, says):
    spec = load_robot(write_own(toml, mjcf))
    with pytest.raises(RebodyError, match=f"(?s){says}"):
        _ = spec.model


def test_an_unknown_name_is_no_path():
    with pytest.raises(RebodyError, match=r"Did you mean 'hopper'\?.*go1, hopper, quadruped, walker, or the path"):
        load_robot("hoper")
