"""The command line on the shipped artifacts: what works, and one clear message for what cannot."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rebody.cli.main import run
from rebody.store import load_artifact, save_artifact
from rebody.store.artifact import SHIPPED


@pytest.fixture
def tasks(tmp_path: Path) -> Path:
    path = tmp_path / "tasks.json"
    path.write_text(json.dumps([{"family": "goal", "target": target} for target in (-4.0, 1.5, 3.0)]))
    return path


@pytest.fixture
def position(tmp_path: Path) -> Path:
    """A copy of the shipped module, to be damaged."""
    return Path(shutil.copytree(SHIPPED / "position", tmp_path / "position"))


def test_list_names_whatever_there_is(capsys: pytest.CaptureFixture[str]):
    assert run(["list"]) == 0
    printed = capsys.readouterr().out
    for name in (
        "point-mass", "cheetah", "hopper", "quadruped", "walker", "goal", "velocity", "readout", "bayes",
        "position-thesis", "tracker-cheetah", "6.9",
    ):  # fmt: skip
        assert name in printed


def test_the_shipped_module_finds_hidden_goals_on_the_cheetah(tasks: Path, tmp_path: Path):
    out = tmp_path / "results" / "cheetah.json"
    words = ["--inference", "position", "--tasks", str(tasks), "--seeds", "2", "--seconds", "10", "--json", str(out)]
    assert run(["evaluate", *words]) == 0
    results = json.loads(out.read_text())
    assert (results["robot"], results["agent"], results["inference"]) == ("cheetah", "reuse", "position")
    assert (results["decision_dt"], results["control_dt"]) == (0.1, 0.05)
    assert len(results["episodes"]) == 6
    assert max(episode["final_error"] for episode in results["episodes"]) < 0.1
    assert not any(episode["fell"] for episode in results["episodes"])
    assert results["summary"]["regret"]["value"] < 0.5
    assert {len(episode["reward"]) for episode in results["episodes"]} == {100}


def test_the_shipped_module_finds_hidden_goals_on_the_point_mass(tasks: Path, tmp_path: Path):
    out = tmp_path / "toy.json"
    words = ["--inference", "position", "--robot", "point-mass", "--tasks", str(tasks), "--json", str(out)]
    assert run(["evaluate", *words]) == 0
    episodes = json.loads(out.read_text())["episodes"]
    assert max(episode["final_error"] for episode in episodes) < 0.15
    assert all(abs(episode["inferred_target"][-1][0] - episode["target"][0]) < 0.15 for episode in episodes)
    returns, oracles = (np.array([episode[key] for episode in episodes]) for key in ("return", "oracle_return"))
    assert (oracles > 1.02 * returns).all()  # who is told is not behind, but for how it arrives
    assert oracles.mean() > returns.mean()


def test_run_draws_an_episode(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    figure = tmp_path / "episode.png"
    assert run(["run", "--task", "goal=2", "--robot", "point-mass", "--figure", str(figure)]) == 0
    assert "hidden goal 2" in capsys.readouterr().out
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["run", "--task", "goal=1", "--robot", "cheeta"], "Did you mean 'cheetah'"),
        (["run", "--task", "goal=far"], "write FAMILY=TARGET"),
        (["run", "--task", "gaol=1"], "Did you mean 'goal'"),
        (["run", "--task", "goal=1", "--inference", "positoin"], "position"),
        (["run", "--task", "goal=1", "--inference", "tracker-cheetah"], "tracker"),
        (
            ["run", "--task", "goal=1", "--agent", "magic"],
            "Agents are: reuse, retrain, readout",
        ),
        (["run", "--task", "goal=1", "--stride", "0"], "--stride must be at least 1"),
        (["run", "--task", "goal=1", "--seconds", "1"], "too short"),
        (["run", "--task", "velocity=1", "--inference", "position"], "cannot infer 'velocity'"),
        (["run", "--task", "goal=1", "--robot", "point-mass", "--agent", "flat"], "a point mass is none"),
        (["run", "--task", "goal=1", "--agent", "oracle", "--thesis"], "thesis mode is for the agents reuse, retrain"),
        (["run", "--task", "goal=1", "--law", "gausian"], "Did you mean 'gaussian'"),
        (["run", "--task", "goal=1", "--law", "plain", "--agent", "bayes"], "by the families' own laws"),
        (["diagnose", "--tasks", "tasks.json", "--law", "plain"], "a diagnosis needs `bayes`"),
        (["run", "--task", "goal=1", "--agent", "flat", "--flat", "tracker-cheetah"], "'flat' is needed"),
        (["train", "flat", "--robot", "cheetah", "--inference", "positoin", "--out", "x"], "mean 'position'?"),
        (["figure", "6.33"], "unknown figure '6.33'. Did you mean '6.3'? Figures are: 6.1, 6.2, 6.3"),
        (["figure", "6.3", "7"], "unknown figure '7'. Figures are:"),
        (["evaluate", "--tasks", "nowhere.json"], "no task file"),
        (["report"], "there is nothing to report. Give the folder of a training run or of an artifact"),
        (["report", "positoin"], "there is no 'positoin'. Give the folder"),
        (["report", "."], "holds nothing to report"),
        (["report", "position", "--out", "page.json"], "must end with .html"),
        (["train", "inference", "positions", "--out", "x"], "Presets are: position"),
        (["train", "inference", "", "--out", "x"], "unknown preset ''"),
        (["train", "inference"], "goal-velocity: Reach a hidden position or run at a hidden speed"),
        (["train", "inference", "--preset", "position", "--out", "x"], "write `rebody train inference PRESET --out"),
        (["train", "tracker", "--robot", "hopper", "--out", "x"], "write `rebody train tracker ROBOT --out"),
        (["stress", "--robot", "cheetah", "--tracker", ""], "not a complete artifact"),  # '' is this folder
        (["train", "tracker", "hoper", "--out", "x"], "Did you mean 'hopper'"),
        (
            ["robot", "check", "hoper"],
            "Robots are: ant, berkeley, cheetah, go1, hopper, quadruped, walker, or the path of a robot's",
        ),
        (["robot", "check", "none.toml"], "cannot read the robot's file 'none.toml'"),
        (["stress", "--robot", "./none.toml"], "cannot read the robot's file 'none.toml'"),
        (["stress", "--episodes", "0"], "--episodes must be at least 1"),
        (["stress", "--robot", "hopper", "--tracker", "tracker-cheetah"], "trained on 'cheetah', not on 'hopper'"),
        (["stress", "--robot", "cheetah", "--tracker", "position"], "'tracker' is needed"),
    ],
)
def test_what_the_user_can_mend_is_one_message(arguments, says, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    printed = capsys.readouterr().err
    assert says in printed
    assert "Traceback" not in printed
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "content",
    ["{", "[]", '{"family": "goal"}', '[{"family": "goal"}]', '[{"family": "goal", "target": "far"}]', "[3]"],
)
def test_a_malformed_task_file_is_refused(content: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path, out = tmp_path / "tasks.json", tmp_path / "out.json"
    path.write_text(content)
    assert run(["evaluate", "--tasks", str(path), "--json", str(out)]) == 2
    assert "tasks.json" in capsys.readouterr().err
    assert not out.exists()


def _flip_a_byte(artifact: Path) -> None:
    weights = bytearray((artifact / "weights.safetensors").read_bytes())
    weights[-5] ^= 1
    (artifact / "weights.safetensors").write_bytes(weights)


def _lose_a_file(artifact: Path) -> None:
    (artifact / "config.json").unlink()


def _be_from_the_future(artifact: Path) -> None:
    manifest = json.loads((artifact / "manifest.json").read_text())
    name = next(key for key in manifest if "version" in key)
    (artifact / "manifest.json").write_text(json.dumps(manifest | {name: 99}))


def _rewrite(change: Callable[[dict], None]) -> Callable[[Path], None]:
    """An artifact that is whole in itself, with another configuration."""

    def damage(artifact: Path) -> None:
        loaded = load_artifact(str(artifact), "inference")
        change(loaded.config)
        texts = {"card": loaded.card, "log": loaded.log}
        save_artifact(artifact, kind="inference", config=loaded.config, weights=loaded.arrays, **texts)

    return damage


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (_flip_a_byte, "weights.safetensors"),
        (_lose_a_file, "config.json"),
        (_be_from_the_future, "99"),
        (_rewrite(lambda config: config["contract"].update(version=99)), "version 99"),
        (_rewrite(lambda config: config["contract"].update(decision_dt=0.05)), "every 0.05 s"),
        (_rewrite(lambda config: config["contract"].update(fields=["x", "y"])), "contract.fields: x, y"),
        (_rewrite(lambda config: config["contract"]["families"]["families"][0].update(name="jump")), "jump"),
        (_rewrite(lambda config: config["inference"].update(units=32)), "position"),
        (_rewrite(lambda config: config["inference"].update(colour="red")), "not understood"),
    ],
)
def test_a_module_that_is_broken_or_does_not_fit_is_refused(damage, says, position, capsys, tasks, tmp_path):
    damage(position)
    out = tmp_path / "out.json"
    assert run(["evaluate", "--tasks", str(tasks), "--inference", str(position), "--json", str(out)]) == 2
    assert says in capsys.readouterr().err
    assert not out.exists()
