"""What a user trained is used as what is shipped, and files are written whole or not at all."""

import json
import shutil

import numpy as np
import pytest

from rebody.agents.parts import load_inference
from rebody.bodies.toys import FullToy, MassDamper, PositionToy
from rebody.cli.main import run
from rebody.ranges import interval
from rebody.store import load_artifact, save_artifact

SECONDS, DECISIONS = "3", 30
TASKS = [
    {"family": "goal", "target": 2.0},
    {"family": "goal", "target": -1.0, "switch": {"at_s": 1.5, "family": "goal", "target": 4.0}},
]
PER_DECISION = {
    "time_s": float, "reward": float, "active_family": str, "active_target": list, "inferred_family": str,
    "inferred_target": list, "cluster": int, "latent": list, "subgoal_family": str, "subgoal": list,
}  # fmt: skip
PER_EPISODE = {"family", "target", "seed", "fell", "return", "oracle_return", "final_error"}
HEAD = {
    "version",
    "robot",
    "agent",
    "inference",
    "decision_dt",
    "control_dt",
    "stride",
    "horizon",
    "thesis",
    "frozen",
    "summary",
}


@pytest.fixture
def tasks(tmp_path):
    path = tmp_path / "tasks.json"
    path.write_text(json.dumps(TASKS))
    return path


@pytest.fixture
def evaluate(trained, tasks, tmp_path):
    """A function: options -> (exit code, what the JSON holds) of an evaluation of the tiny artifacts."""

    def evaluate(*options):
        out = tmp_path / "out.json"
        parts = ["--inference", str(trained["inference"]), "--seconds", SECONDS, "--seeds", "2"]
        code = run(["evaluate", "--tasks", str(tasks), *parts, "--json", str(out), *options])
        return code, json.loads(out.read_text()) if out.exists() else None

    return evaluate


@pytest.mark.parametrize("robot", ["point-mass", "cheetah"])
def test_the_json_is_as_documented(robot, trained, evaluate, capsys):
    tracker = [] if robot == "point-mass" else ["--tracker", str(trained["tracker"])]
    code, results = evaluate("--robot", robot, *tracker, "--stride", "2", "--horizon", "3")
    assert code == 0
    assert robot in capsys.readouterr().out
    assert results.keys() >= HEAD
    assert (results["version"], results["robot"], results["agent"]) == (2, robot, "reuse")
    assert (results["inference"], results["stride"], results["horizon"]) == ("inference", 2, 3)
    assert (results["decision_dt"], results["control_dt"]) == (0.1, 0.1 if robot == "point-mass" else 0.05)
    assert [(e["family"], *e["target"], e["seed"]) for e in results["episodes"]] == [
        ("goal", 2.0, 0), ("goal", 2.0, 1), ("goal", -1.0, 0), ("goal", -1.0, 1),
    ]  # fmt: skip
    for episode in results["episodes"]:
        assert episode.keys() >= PER_EPISODE
        for name, kind in PER_DECISION.items():
            assert len(episode[name]) == DECISIONS, name
            assert all(isinstance(value, kind) for value in episode[name]), name
        np.testing.assert_allclose(episode["time_s"], 0.1 * np.arange(1, DECISIONS + 1), atol=1e-6)
        missed = np.abs(np.subtract(episode["quantities"]["x"], np.ravel(episode["active_target"])))
        np.testing.assert_allclose(episode["reward"], -missed, atol=1e-4)
        assert episode["return"] == pytest.approx(sum(episode["reward"]), abs=1e-2)
        missed_at_last = np.abs(np.subtract(episode["quantities"]["x"][-20:], episode["active_target"][-1]))
        assert episode["final_error"] == pytest.approx(missed_at_last.mean(), abs=1e-3)
        assert (np.diff(np.ravel(episode["subgoal"]))[::2] == 0).all()  # held for two decisions
        assert isinstance(episode["oracle_return"], float)
    switched = results["episodes"][2]
    assert switched["switch"] == TASKS[1]["switch"] | {"target": [4.0]}
    assert switched["active_target"] == 15 * [[-1.0]] + 15 * [[4.0]]
    assert results["summary"]["families"]["goal"]["episodes"] == 4


def test_oracle_and_idle_do_not_listen_to_the_module(trained, evaluate):
    tracker = ["--robot", "cheetah", "--tracker", str(trained["tracker"])]
    _, oracle = evaluate(*tracker, "--agent", "oracle")
    _, idle = evaluate(*tracker, "--agent", "idle")
    for told, still in zip(oracle["episodes"], idle["episodes"], strict=True):
        assert told["subgoal"] == told["active_target"]
        assert told["return"] == pytest.approx(told["oracle_return"])
        assert set(still["subgoal_family"]) == {"velocity"}
        assert set(np.ravel(still["subgoal"])) == {0.0}
        assert still["oracle_return"] == pytest.approx(told["return"])


def test_thesis_mode_takes_the_thesis_horizon(trained, evaluate):
    tracker = ["--robot", "cheetah", "--tracker", str(trained["tracker"])]
    for options, mode in (
        ((), (False, 1, 15)),
        (("--thesis", "--stride", "10"), (True, 10, 1)),
        (("--thesis", "--horizon", "4"), (True, 1, 4)),
    ):
        code, results = evaluate(*tracker, *options)
        assert code == 0
        assert (results["thesis"], results["stride"], results["horizon"]) == mode


def test_strides_are_predicted_by_an_own_step_predictor(trained, evaluate, tmp_path, capsys):
    tracker = ["--robot", "cheetah", "--tracker", str(trained["tracker"])]
    predicted = [*tracker, "--stride", "predicted", "--step-predictor", str(trained["step-predictor"])]
    code, results = evaluate(*predicted, "--thesis")
    assert code == 0
    assert (results["thesis"], results["stride"], results["horizon"]) == (True, "predicted", 1)
    for episode in results["episodes"]:
        np.testing.assert_allclose(episode["time_s"], 0.1 * np.arange(1, DECISIONS + 1), atol=1e-6)
        assert len(np.unique(episode["latent"], axis=0)) > 1
    parts = ["--inference", str(trained["inference"]), *predicted, "--seconds", SECONDS]
    assert run(["run", "--task", "goal=2", *parts, "--thesis"]) == 0
    assert "hidden goal 2" in capsys.readouterr().out

    refused(evaluate(*predicted)[0], capsys, "--stride predicted is of thesis mode: add --thesis")
    refused(evaluate(*predicted, "--thesis", "--robot", "point-mass")[0], capsys, "a point mass has none")
    kind = [*tracker, "--thesis", "--stride", "predicted", "--step-predictor", str(trained["tracker"])]
    refused(evaluate(*kind)[0], capsys, "kind 'tracker'", "'step-predictor' is needed")


def test_a_step_predictor_learns_on_a_tracker_of_its_robot(trained, tmp_path, capsys):
    train = ["train", "step-predictor", "--robot", "cheetah", "--out", str(tmp_path / "new")]
    refused(run([*train, "--tracker", str(trained["flat"])]), capsys, "kind 'flat'", "'tracker' is needed")
    refused(run([*train, "--steps", "19"]), capsys, "--steps must be at least 20")
    other = ["--robot", "hopper", "--tracker", str(trained["tracker"])]
    refused(run([*train, *other]), capsys, "trained on 'cheetah', not on 'hopper'")
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("agent", ["readout", "bayes"])
def test_what_is_read_is_handed_to_the_tracker(agent, trained, evaluate):
    _, results = evaluate("--robot", "cheetah", "--tracker", str(trained["tracker"]), "--agent", agent)
    assert results["agent"] == agent
    for episode in results["episodes"]:
        assert episode["subgoal"][1:] == episode["inferred_target"][:-1]
        assert set(episode["subgoal_family"]) == {"goal"}


def test_one_that_learned_everything_itself_is_judged(trained, evaluate, capsys):
    parts = ["--agent", "scratch", "--scratch", str(trained["scratch"])]
    code, results = evaluate(*parts, "--robot", "cheetah")
    assert code == 0
    assert "cheetah, scratch" in capsys.readouterr().out
    assert results["inference"] == "scratch"  # its own module
    for episode in results["episodes"]:
        assert set(episode["subgoal"]) == {None}
        assert len(np.unique(episode["latent"], axis=0)) > 1

    refused(evaluate(*parts, "--robot", "point-mass")[0], capsys, "a point mass is none")
    refused(evaluate(*parts, "--robot", "hopper")[0], capsys, "trained on 'cheetah', not on 'hopper'")
    refused(evaluate("--agent", "scratch", "--robot", "walker")[0], capsys, "scratch-walker")


def test_an_own_high_level_policy_is_judged(trained, evaluate, tmp_path, capsys):
    parts = ["--robot", "cheetah", "--tracker", str(trained["tracker"]), "--agent", "retrain"]
    code, results = evaluate(*parts, "--high-level", str(trained["high-level"]))
    assert code == 0
    assert "cheetah, retrain" in capsys.readouterr().out
    for episode in results["episodes"]:
        asked = np.subtract(np.ravel(episode["subgoal"])[1:], episode["quantities"]["x"][:-1])
        assert (np.abs(asked) <= 5.0 + 1e-4).all()
        assert len(np.unique(asked)) > 1

    alone = ["--agent", "retrain", "--high-level", str(trained["high-level"])]
    refused(evaluate(*alone, "--robot", "point-mass")[0], capsys, "a point mass is none")
    refused(evaluate("--agent", "retrain", "--robot", "cheetah")[0], capsys, "high-level-inference-cheetah")
    refused(evaluate(*alone, "--robot", "cheetah")[0], capsys, "trained with another tracker than 'tracker-cheetah'")
    loaded = load_artifact(trained["high-level"], "high-level")
    save_artifact(
        tmp_path / "other", kind="high-level", config=loaded.config | {"inference_hash": "0" * 64},
        weights=loaded.arrays, card=loaded.card, log=loaded.log,
    )  # fmt: skip
    refused(evaluate(*parts, "--high-level", str(tmp_path / "other"))[0], capsys, "another module than 'inference'")


def test_an_own_flat_policy_is_judged(trained, evaluate, tmp_path, capsys):
    parts = ["--robot", "cheetah", "--tracker", str(trained["tracker"]), "--agent", "flat"]
    code, results = evaluate(*parts, "--flat", str(trained["flat"]))
    assert code == 0
    assert "cheetah, flat" in capsys.readouterr().out
    for episode in results["episodes"]:
        assert episode["subgoal"] == [None] * DECISIONS
        assert isinstance(episode["oracle_return"], float)
    run_it = ["run", "--task", "goal=2", "--inference", str(trained["inference"]), *parts, "--seconds", SECONDS]
    figure = tmp_path / "flat.png"
    assert run([*run_it, "--flat", str(trained["flat"]), "--figure", str(figure)]) == 0
    assert figure.read_bytes().startswith(b"\x89PNG")


def test_a_flat_policy_of_another_module_or_robot_is_refused(trained, evaluate, tmp_path, capsys):
    loaded = load_artifact(trained["flat"], "flat")
    for change, said in (
        ({"inference_hash": "0" * 64}, "another module than 'inference'"),
        ({"robot": "walker"}, "trained on 'walker', not on 'cheetah'"),
    ):
        changed = {"config": loaded.config | change, "weights": loaded.arrays, "card": loaded.card, "log": loaded.log}
        save_artifact(tmp_path / "other", kind="flat", **changed)
        parts = ["--tracker", str(trained["tracker"]), "--agent", "flat", "--flat", str(tmp_path / "other")]
        code, results = evaluate(*parts)
        refused(code, capsys, said)
        assert results is None


def test_a_module_of_the_position_toy(tiny_training, tmp_path):
    """The thesis' first experiment, untrained; any setting of a preset can be changed."""
    untrained = ["--wander-iterations", "0", "--joint-iterations", "0", "--policy-iterations", "0"]
    out = str(tmp_path / "thesis")
    thesis = [*tiny_training["inference"], *untrained]
    thesis[2] = "position-thesis"
    assert run([*thesis, "--out", out]) == 0
    loaded = load_inference(out)
    assert loaded.toy == PositionToy()
    assert loaded.contract.families.ranges == {"goal": interval(0.0, 10.0)}
    assert loaded.parts.module.encoder.latent == 1
    assert loaded.parts.high_level.view.fields == loaded.parts.told_policy.view.fields == ("x",)
    assert run([*thesis, "--toy", "mass-damper", "--out", str(tmp_path / "other")]) == 0
    assert load_inference(str(tmp_path / "other")).toy == MassDamper()


def test_a_module_of_the_full_toy_is_what_was_asked_for(full_module):
    loaded = load_inference(str(full_module))
    module = loaded.parts.module
    assert loaded.toy == FullToy()
    assert loaded.contract.families.names == ("goal", "velocity", "stand")
    assert loaded.contract.window is module.encoder.window is None
    assert (module.encoder.latent, module.encoder.kinds, module.decoder.kinds) == (5, 2, 2)
    assert module.labeller.weights[-1].shape == (5, 6)
    assert loaded.parts.mixture.mean.shape == (6, 2)
    assert loaded.parts.mixture.active.any()
    assert np.abs(loaded.parts.probe.target_weights).max(axis=0).min() > 0
    assert loaded.parts.probe.families == loaded.contract.families
    log = (full_module / "log.csv").read_text().splitlines()
    assert len(log) == 5
    assert {"kl", "mixture/components", "told/return"} <= set(log[0].split(","))
    card = (full_module / "card.md").read_text()
    for said in ("stand median", "decisions to a new base task", "false changes in 1000", "family ARI of 2000 beliefs"):
        assert said in card


def test_a_module_of_the_full_toy_acts_on_it_as_when_it_was_saved(full_module, tasks, tmp_path):
    tasks.write_text(json.dumps([{"family": "stand", "target": -1.0}, {"family": "velocity", "target": 2.0}]))
    parts = ["--inference", str(full_module), "--robot", "point-mass", "--seconds", SECONDS]
    results = []
    for agent in ("reuse", "reuse", "oracle", "readout", "bayes", "idle"):
        out = tmp_path / "out.json"
        assert run(["evaluate", "--tasks", str(tasks), *parts, "--agent", agent, "--json", str(out)]) == 0
        results.append(json.loads(out.read_text()))
    assert results[0] == results[1]
    assert results[0]["summary"]["families"].keys() == {"stand", "velocity"}
    stands = results[0]["episodes"][0]
    missed = np.abs(np.array(stands["quantities"]["pitch"]) + 1.0)
    np.testing.assert_allclose(stands["reward"], -missed, atol=1e-4)  # relative to 1 rad
    assert stands["final_error"] == pytest.approx(missed[-20:].mean(), abs=1e-4)
    assert np.abs(stands["quantities"]["pitch"]).max() > 0
    assert not np.any([episode["quantities"]["pitch"] for episode in results[-1]["episodes"]])
    assert {cluster for episode in results[0]["episodes"] for cluster in episode["cluster"]} <= set(range(6))


def test_a_module_that_stands_does_not_fit_a_robot_whose_tracker_cannot(full_module, tasks, capsys):
    parts = ["--inference", str(full_module), "--robot", "hopper", "--agent", "readout"]
    code = run(["evaluate", "--tasks", str(tasks), *parts])
    refused(code, capsys, "no slot for stand")


def test_a_diagnosis_and_own_artifacts_are_reported(trained, tasks, tmp_path, capsys):
    out, page = tmp_path / "diagnosis", tmp_path / "page.html"
    parts = ["--inference", str(trained["inference"]), "--tracker", str(trained["tracker"]), "--seconds", SECONDS]
    assert run(["diagnose", "--tasks", str(tasks), *parts, "--out", str(out)]) == 0
    assert sorted(path.name for path in out.iterdir()) == [
        f"{agent}.json" for agent in ("bayes", "idle", "oracle", "readout", "reuse")
    ]
    runs = [str(trained["inference"]), str(trained["tracker"]), str(out), str(out / "reuse.json")]
    assert run(["report", *runs, "--out", str(page)]) == 0
    assert f"written: {page}" in capsys.readouterr().out
    for words in ("Learning curves", "return that it costs", "Low-level policy of", "clusters against base tasks"):
        assert words in page.read_text(), words


def test_the_same_command_writes_the_same_results(trained, evaluate):
    tracker = ["--robot", "cheetah", "--tracker", str(trained["tracker"])]
    assert evaluate(*tracker) == evaluate(*tracker)


def test_run_draws_on_own_artifacts(trained, tmp_path, capsys):
    parts = ["--inference", str(trained["inference"]), "--tracker", str(trained["tracker"])]
    figure = tmp_path / "new" / "episode.pdf"
    assert run(["run", "--task", "goal=-2", *parts, "--seconds", SECONDS, "--figure", str(figure)]) == 0
    assert "hidden goal -2: read from the belief" in capsys.readouterr().out
    assert figure.read_bytes().startswith(b"%PDF")
    assert [path.name for path in figure.parent.iterdir()] == [figure.name]


def refused(code, capsys, *said):
    """Whether a command ended as it should when the user can mend something: one line, no traceback."""
    complaint = capsys.readouterr().err
    assert code == 2
    assert complaint.startswith("error: ")
    assert complaint.count("\n") == 1
    for part in said:
        assert part in complaint


@pytest.mark.parametrize("name", ["tracker", "inference"])
@pytest.mark.parametrize("file", ["weights.safetensors", "config.json", "card.md", "log.csv", "manifest.json"])
def test_a_flipped_byte_is_noticed_wherever_it_is(name, file, trained, evaluate, tmp_path, capsys):
    broken = shutil.copytree(trained[name], tmp_path / "broken")
    data = bytearray((broken / file).read_bytes())
    data[len(data) // 2] ^= 1
    (broken / file).write_bytes(data)
    parts = {"tracker": str(trained["tracker"]), name: str(broken)}
    code, results = evaluate(*(word for part, folder in parts.items() for word in (f"--{part}", folder)))
    refused(code, capsys, "damaged", file if file != "manifest.json" else "")
    assert results is None


@pytest.mark.parametrize("name", ["tracker", "inference"])
def test_a_missing_artifact_or_file_is_named(name, trained, evaluate, tmp_path, capsys):
    refused(evaluate(f"--{name}", str(tmp_path / "none"))[0], capsys, str(tmp_path / "none"), "or a folder of your own")
    broken = shutil.copytree(trained[name], tmp_path / "broken")
    (broken / "weights.safetensors").unlink()
    code, _ = evaluate(f"--{name}", str(broken))
    refused(code, capsys, "weights.safetensors is missing")


def test_an_artifact_of_the_other_kind_is_named(trained, evaluate, capsys):
    refused(evaluate("--tracker", str(trained["inference"]))[0], capsys, "kind 'inference'", "'tracker' is needed")
    refused(evaluate("--inference", str(trained["tracker"]))[0], capsys, "kind 'tracker'", "'inference' is needed")


@pytest.mark.parametrize("seconds", ["nan", "inf", "-5", "2.9"])
def test_a_length_that_makes_no_sense(seconds, evaluate, capsys):
    code, results = evaluate("--robot", "point-mass", "--seconds", seconds)
    refused(code, capsys, "--seconds")
    assert results is None


@pytest.mark.parametrize("option", ["--seeds", "--stride", "--horizon"])
def test_less_than_one_makes_no_sense(option, evaluate, capsys):
    refused(evaluate("--robot", "point-mass", option, "0")[0], capsys, f"{option} must be at least 1")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("evaluate --tasks tasks.json --json folder", "folder is a folder"),
        ("evaluate --tasks tasks.json --json tasks.json/x/out.json", "tasks.json is a file, not a folder"),
        ("run --task goal=1 --figure episode.xyz", "must end with .png or .pdf or .svg"),
        ("run --task goal=1 --figure episode", "must end with .png"),
        ("run --task goal=1 --figure folder.png", "is a folder"),
        ("run --task goal=1 --video film.foo", "must end with .mp4"),
    ],
)
def test_what_cannot_be_written_is_refused_before_any_work(words, said, tasks, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder.png").mkdir()
    before = sorted(tmp_path.rglob("*"))
    refused(run([*words.split(), "--inference", "never-looked-at"]), capsys, said)
    assert sorted(tmp_path.rglob("*")) == before


def test_a_system_that_refuses_to_write_is_one_message(evaluate, monkeypatch, tmp_path, capsys):
    def full(*_):
        raise OSError(28, "No space left on device", str(tmp_path / "out.json"))

    with monkeypatch.context() as patched:
        patched.setattr("os.replace", full)
        code, results = evaluate("--robot", "point-mass")
    refused(code, capsys, "out.json", "No space left on device")
    assert results is None
    assert [path.name for path in tmp_path.iterdir()] == ["tasks.json"]


def test_unknown_options_are_usage_errors(capsys):
    for words in ("evaluate", "run --task goal=1 --colour red", "train tracker hopper", "fly"):
        with pytest.raises(SystemExit) as stopped:
            run(words.split())
        assert stopped.value.code == 2
    assert "Traceback" not in capsys.readouterr().err


def test_a_tracker_for_another_robot_is_refused(trained, evaluate, tmp_path, capsys):
    loaded = load_artifact(trained["tracker"], "tracker")
    config = loaded.config | {"robot": "walker"}
    other = save_artifact(tmp_path / "other", kind="tracker", config=config, weights=loaded.arrays, card="", log="")
    refused(evaluate("--tracker", str(other))[0], capsys, "trained on 'walker', not on 'cheetah'")
