"""A policy that was learned here comes back as an ONNX file, and acts the same."""

from itertools import pairwise

import numpy as np
import pytest
from tests.walking import CART, CART_TOML

from rebody.bodies import load_robot, simulate
from rebody.bodies.walking.export import export_onnx
from rebody.bodies.walking.onnx_file import OnnxPolicy
from rebody.bodies.walking.trained import KIND, TrainedPolicy
from rebody.cli.main import run
from rebody.errors import RebodyError
from rebody.store import save_artifact

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")
INPUTS = ("linear_velocity", "gravity", "joint_velocities", "last_action", "command")
SIZES = (13, 7, 4)


@pytest.fixture
def policy(tmp_path):
    """Random networks, for the cart."""
    rng = np.random.default_rng(0)
    weights = {f"weights.{i}": rng.normal(size=(n, m)) for i, (n, m) in enumerate(pairwise(SIZES))}
    biases = {f"biases.{i}": rng.normal(size=m) for i, m in enumerate(SIZES[1:])}
    settings = {
        "robot": "cart",
        "control_dt": 0.02,
        "inputs": INPUTS,
        "joints": ("right", "left"),
        "rest": (0.1, -0.2),
        "action_scale": (3.0, 4.0),
        "stiffness": (),
        "damping": (),
        "low": (-0.8, 0.0, -1.5),
        "high": (1.0, 0.0, 1.5),
        "dead": (0.1, 0.0, 0.2),
        "drift": (0.0, 0.0, -0.05),
        "hidden": SIZES[1:-1],
        "at_once": 1.5,
        "rate": 2.0,
    }
    arrays = {name: array.astype(np.float32) for name, array in (weights | biases).items()}
    folder = tmp_path / "learned"
    save_artifact(folder, kind=KIND, config=settings, weights=arrays, card="# A cart", log="")
    return TrainedPolicy(str(folder))


def described(folder, table):
    """The cart with another policy."""
    toml = CART_TOML.replace('onnx = "cart.onnx"\ninputs = ["command"]', table)
    (folder / "cart.xml").write_text(CART)
    (folder / "cart.toml").write_text(toml)
    return load_robot(str(folder / "cart.toml"))


def test_the_file_acts_as_the_artifact(policy, tmp_path):
    export_onnx(policy, tmp_path / "policy.onnx")
    seen = np.random.default_rng(1).normal(size=(20, SIZES[0])).astype(np.float32)
    ours, theirs = policy(seen, {})[0], OnnxPolicy(tmp_path / "policy.onnx")(seen, {})[0]
    np.testing.assert_allclose(ours, theirs, atol=1e-5)
    hidden = seen @ policy.layers[0][0] + policy.layers[0][1]
    hidden = hidden / (1 + np.exp(-hidden))
    np.testing.assert_allclose(ours, np.tanh(hidden @ policy.layers[1][0] + policy.layers[1][1])[:, :2], atol=1e-5)


def test_a_robot_moves_alike_by_either(policy, tmp_path):
    export_onnx(policy, tmp_path / "policy.onnx")
    batches = []
    for table in ('artifact = "./learned"', 'onnx = "policy.onnx"'):
        batch = simulate(described(tmp_path, table), 3)
        batch.reset(np.random.default_rng(0))
        for _ in range(20):
            batch.follow(np.array([[0.5, 0.0, 0.2], [0.0, 0.0, 0.0], [-0.5, 0.0, -1.0]]))
        batches.append(batch)
    np.testing.assert_allclose(batches[0].qpos, batches[1].qpos, atol=1e-5)
    assert np.ptp(batches[0].pose()[:, 0]) > 0.01


def test_what_was_measured_of_it_comes_with_the_artifact(policy, tmp_path):
    stick = described(tmp_path, 'artifact = "./learned"').walking.joystick
    assert (stick.dead, stick.drift) == ((0.1, 0.0, 0.2), (0.0, 0.0, -0.05))
    assert (stick.at_once, stick.rate) == (1.5, 2.0)
    own = CART_TOML.replace("turn = [-1.5, 1.5]", "turn = [-1.5, 1.5]\ndead = [0.0, 0.0, 0.0]\nrate = inf")
    (tmp_path / "cart.toml").write_text(own.replace('onnx = "cart.onnx"', 'artifact = "./learned"'))
    stick = load_robot(str(tmp_path / "cart.toml")).walking.joystick
    assert (stick.dead, stick.at_once, stick.rate) == ((0.0, 0.0, 0.0), 1.5, np.inf)


def test_the_command_says_what_a_description_needs(policy, tmp_path, capsys):
    out = tmp_path / "policy.onnx"
    assert run(["export", policy.reference, "--out", str(out)]) == 0
    said = capsys.readouterr().out
    for part in (
        "[policy]",
        "[policy.joystick]",
        "forward = [-0.8, 1]",
        "dead = [0.1, 0.0, 0.2]",
        "at_once = 1.5",
        "rate = 2",
    ):
        assert part in said
    assert OnnxPolicy(out).metadata["joint_names"] == "right,left"
    assert run(["export", "tracker-cheetah", "--out", str(out)]) == 2
    assert "one of kind 'walking' is needed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"rest": (0.1,)}, "rest: 2 numbers are needed"),
        ({"inputs": ("phase",)}, "does not hear phase"),
        ({"hidden": (8,)}, "its layer 1 is not 13 x 8 numbers"),
        ({"robot": 3}, "robot"),
        ({"at_once": 4.0}, "at_once: it must be from 1 to 3"),
    ],
)
def test_a_damaged_artifact_is_refused(policy, tmp_path, change, says):
    artifact = policy._artifact
    config = artifact.config | change
    save_artifact(tmp_path / "bad", kind=KIND, config=config, weights=artifact.arrays, card="# bad", log="")
    with pytest.raises(RebodyError, match=says):
        _ = TrainedPolicy(str(tmp_path / "bad")).layers


def test_two_policies_are_one_too_many(policy, tmp_path):
    with pytest.raises(RebodyError, match="onnx and artifact are two policies"):
        described(tmp_path, 'onnx = "cart.onnx"\nartifact = "./learned"')
