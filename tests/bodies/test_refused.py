"""Robots that no training could use: the check names what is wrong, and training refuses them before any work."""

import pytest

from rebody.bodies import load_robot
from rebody.bodies.check import check_robot
from rebody.cli.main import run

X, Z = '<joint name="x" type="slide" axis="1 0 0"/>', '<joint name="z" type="slide" axis="0 0 1"/>'
PITCH = '<joint name="p" axis="0 1 0"/>'
FREE, HIP, FLOOR = "<freejoint/>", '<joint name="hip" axis="0 1 0" damping="1"/>', '<geom type="plane" size="9 9 1"/>'
NO_FLOOR = [(FLOOR, "")]


def root(x="x", z="z", pitch="p"):
    return [('body = "trunk"', f'x = "{x}"\nz = "{z}"\npitch = "{pitch}"')]


WRONG = {
    "swapped joints": (root(x="z", z="x"), [(FREE, X + Z + PITCH)], {"x": "'z' is no slide along x"}),
    "one joint three times": (root("x", "x", "x"), [(FREE, X + Z + PITCH)], {"pitch": "'x' is no hinge about y"}),
    "a hip as pitch": (
        root(pitch="hip"),
        [(FREE, X + Z + PITCH)],
        {"root body": "'hip' turns body 'leg' and leaves trunk"},
    ),
    "a hip as pitch of a trunk that does not turn": (
        root(pitch="hip"),
        [(FREE, X + Z)],
        {"root body": "'hip' turns body 'leg' and leaves trunk"},
    ),
    "x of another body": (
        root(),
        [(FREE, Z + PITCH), ("</worldbody>", f'<body pos="3 0 1">{X}<geom size="0.1"/></body></worldbody>')],
        {"root body": "'x' does not move body 'trunk', which 'p' turns"},
    ),
    "slides that turn with the trunk": (
        root(),
        [(FREE, PITCH + X + Z)],
        {"x": "'x' is no slide along x once pitch has turned it", "z": "put the hinge last"},
    ),
    "no floor": ([], NO_FLOOR, {"floor": "nothing of it touches a geom of the world"}),
    "a floor for something else": (
        [],
        [
            (FLOOR, '<geom type="box" size="0.5 0.5 0.1" pos="5 0 -0.1"/>'),
            ("</worldbody>", '<body pos="5 0 0.2"><freejoint/><geom size="0.1"/></body></worldbody>'),
        ],
        {"floor": "nothing of it touches a geom of the world"},
    ),
    "a joint outside its range": (
        [],
        [('name="hip"', 'name="hip" limited="true" range="20 60"')],
        {"rest pose": "'hip' begins at 0, out of its range 0.349 to 1.05: see [rest]"},
    ),
    "a step of 3 ms": (
        [],
        [('timestep="0.01"', 'timestep="0.003"')],
        {"control step": "set timestep = 0.0025 in its TOML file and frame_skip = 2, 4, 5, 8, 10, 20 or 40"},
    ),
    "an actuator without a range": ([], [(' ctrllimited="true" ctrlrange="-1 1"', "")], {"actuators": "no ctrlrange"}),
}


@pytest.fixture(params=WRONG)
def wrong(request, write_own):
    """Path of a robot's file, and what is to be said of it."""
    toml, mjcf, expected = WRONG[request.param]
    return write_own(toml, mjcf), expected


def test_the_check_says_what_is_wrong(wrong):
    path, expected = wrong
    found = {finding.subject: finding.says for finding in check_robot(load_robot(path)) if not finding.is_right}
    assert found.keys() >= expected.keys()
    for subject, says in expected.items():
        assert says in found[subject]


def test_a_tracker_is_not_trained_on_it(wrong, tmp_path, capsys):
    path, expected = wrong
    assert run(["train", "tracker", path, "--out", str(tmp_path / "tracker")]) == 2
    said = capsys.readouterr().err
    assert "robot 'own' is not ready" in said
    for subject, says in expected.items():
        assert f"{subject}: " in said
        assert says in said
    assert not (tmp_path / "tracker").exists()


def test_nothing_is_trained_from_scratch_without_a_floor(write_own, tmp_path, capsys):
    out = tmp_path / "scratch"
    assert run(["train", "scratch", "--robot", write_own(mjcf=NO_FLOOR), "--out", str(out)]) == 2
    assert "add a floor" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize("kind", ["flat", "high-level", "step-predictor"])
def test_nothing_else_is_trained_on_it(kind, write_own, tmp_path, capsys):
    out = tmp_path / kind
    assert run(["train", kind, "--robot", write_own(mjcf=NO_FLOOR), "--out", str(out)]) == 2
    assert "add a floor" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("mjcf", "says"),
    [
        (
            [("<worldbody>", '<asset><mesh file="shell.stl"/></asset><worldbody><geom type="mesh" mesh="shell"/>')],
            "shell.stl",
        ),
        ([("<worldbody>", '<size memory="900G"/><worldbody>')], "Could not allocate memory"),
        ([("<mujoco>", "<mujoco>" + "<worldbody>" * 9000)], "nesting is too deep"),
        ([("<mujoco>", "<mujoco><!--" + 17_000_000 * "x" + "-->")], "own.xml is larger than 16 MB"),
    ],
)
def test_a_model_that_mujoco_cannot_have_is_one_message(mjcf, says, write_own, tmp_path, capsys):
    assert run(["train", "tracker", write_own(mjcf=mjcf), "--out", str(tmp_path / "tracker")]) == 2
    said = capsys.readouterr().err
    assert "error: " in said
    assert says in said
    assert not (tmp_path / "tracker").exists()


# those that are unusual, and can be used

BALL = [(HIP, '<joint name="hip" type="ball" damping="1"/>')]
SECOND = [("</worldbody>", '<body name="toy" pos="1 0 0.1"><freejoint/><geom size="0.1"/></body></worldbody>')]
FILTERED = [
    ('<motor name="muscle"', '<general name="muscle" dyntype="filter" dynprm="0.1" ctrllimited="true" ctrlrange="-1 1"')
]
DELAYED = [('<motor name="muscle"', '<motor name="muscle" delay="0.05" nsample="5"')]
USABLE = {"ball joint": BALL, "second free body": SECOND, "filtered actuator": FILTERED, "delayed actuator": DELAYED}
TINY = """
    --robots 4 --steps 4 --updates 2 --iterations 2 --replay 60 --sac.hidden 8 8 --sac.batch-size 8
    --held-out 4 --held-out-s 3
"""


@pytest.mark.parametrize("kind", USABLE)
def test_an_unusual_robot_is_ready(kind, write_own):
    assert all(finding.is_right for finding in check_robot(load_robot(write_own(mjcf=USABLE[kind]))))


def test_a_robot_that_is_all_of_this_is_trained(write_own, tmp_path):
    path = write_own(mjcf=[*BALL, *SECOND, *FILTERED])
    assert run(["train", "tracker", path, *TINY.split(), "--out", str(tmp_path / "tracker")]) == 0
    assert (tmp_path / "tracker" / "card.md").exists()


def test_a_rest_pose_of_ones_own_brings_a_joint_into_its_range(write_own):
    ranged = [('name="hip"', 'name="hip" limited="true" range="20 60"')]
    spec = load_robot(write_own([("[fall]", "[rest]\nhip = 0.5\n[fall]")], ranged))
    assert all(finding.is_right for finding in check_robot(spec))
    assert spec.rest_qpos.tolist() == [0.0, 0.0, 0.0, 0.5]


def test_a_time_step_of_ones_own_makes_a_step_of_3_ms_fit(write_own):
    spec = load_robot(
        write_own([("frame_skip = 5", "frame_skip = 5\ntimestep = 0.0025")], [('timestep="0.01"', 'timestep="0.003"')])
    )
    assert (spec.model.opt.timestep, spec.steps_per_decision) == (0.0025, 8)
    assert all(finding.is_right for finding in check_robot(spec))
