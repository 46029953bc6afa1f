"""Which level of a robot that walks already lost what, and how it stands pushes."""

import io

import numpy as np
import pytest
from rich.console import Console
from tests.walking import write_cart

from rebody.bodies import RobotBatch, load_robot
from rebody.bodies.walking.exact import ExactWalkers
from rebody.cli.main import run
from rebody.cli.trial import TrialOptions
from rebody.evaluation import stress as module
from rebody.evaluation.diagnosis import EXACT, WALKING_LADDER, diagnose, diagnosis_tables
from rebody.report.diagnosis import plot_diagnosis
from rebody.tasks.task_file import TaskSpec

pytest.importorskip("onnxruntime")
pytest.importorskip("onnx")


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    return str(write_cart(tmp_path_factory.mktemp("cart")))


def test_a_body_that_goes_exactly_as_its_joystick_says(robot):
    batch = ExactWalkers(load_robot(robot), 3)
    batch.reset(np.random.default_rng(0))
    for _ in range(round(2.0 / batch.step_s)):
        batch.follow(np.array([[0.5, 0.0, 0.0], [0.0, 0.3, 0.0], [1.0, 0.0, np.pi / 4]]))
    circle = 4 / np.pi
    np.testing.assert_allclose(batch.pose()[:2, :2], [[1.0, 0.0], [0.0, 0.6]], atol=1e-6)
    np.testing.assert_allclose(batch.pose()[2, :2], [circle, circle], atol=1e-3)
    np.testing.assert_allclose(batch.pose()[2, 5], np.pi / 2, atol=1e-6)
    np.testing.assert_allclose(batch.observe().vx[0], 0.5, atol=1e-5)
    assert not batch.fallen.any()


def test_a_diagnosis_tells_the_navigator_from_the_walking_policy(robot, tmp_path):
    trial = TrialOptions(robot=robot, inference="plane", seconds=6.0).load()
    heard = []
    diagnosis = diagnose(trial, [TaskSpec("place", (2.0, 1.0)), TaskSpec("heading", (1.0,))], 1, heard.append)
    assert heard == [EXACT, *[agent for agent in WALKING_LADDER if agent != EXACT]]
    returns = np.mean([episode.return_ for episode in diagnosis.results["reuse"].episodes])
    assert sum(diagnosis.lost().values()) == pytest.approx(returns)
    assert diagnosis.results[EXACT].episodes[0].final_error < 0.05
    text = io.StringIO()
    for table in diagnosis_tables(diagnosis):
        Console(file=text, width=200).print(table)
    assert "the navigator, told the target" in text.getvalue()
    assert "walking policy" in text.getvalue()
    plot_diagnosis(diagnosis, tmp_path / "diagnosis.png")
    assert (tmp_path / "diagnosis.png").stat().st_size > 10_000


def test_a_robot_that_walks_is_stressed_by_its_navigator_and_pushed_in_any_direction(robot, monkeypatch, capsys):
    monkeypatch.setattr(module, "SECONDS", 2.0)
    monkeypatch.setattr(module, "PUSH_S", (0.5, 1.0))
    pushed = []
    monkeypatch.setattr(RobotBatch, "push", lambda batch, change: pushed.append(change.copy()))
    assert run(["stress", "--robot", robot, "--episodes", "3", "--push", "0.5"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "cart, navigator" in printed
    assert "pushed by 0.5 m/s in any direction" in printed
    size = np.linalg.norm(np.array(pushed), axis=-1)
    assert size.shape[1] == 3
    np.testing.assert_allclose(size[size > 0], 0.5)
    assert np.unique(np.array(pushed)[..., 1]).size > 3
