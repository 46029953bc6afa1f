"""A run may be made longer or shorter, and ended as it stands."""

import json
import signal

import pytest

from rebody.errors import RebodyError
from rebody.store import load_artifact, read_meta

TURNS = 9
LENGTHS = ("iterations", "wander_iterations", "joint_iterations", "policy_iterations")


def length(pipeline, turns):
    """The options that let a run of that kind end after so many turns; an inference run has three at the least."""
    return ["--policy-iterations", turns - 3] if pipeline.name == "inference" else ["--iterations", turns]


@pytest.fixture
def stopped(pipeline, tmp_path, after_turn):
    """Folder of a run that was interrupted after four turns."""
    interrupts = iter([signal.SIGINT])
    after_turn(4, lambda: [signal.raise_signal(each) for each in interrupts])  # once, not in later runs
    assert pipeline(tmp_path / "stopped") == 130
    return tmp_path / "stopped"


def card_and_rows(out):
    return (out / "card.md").read_text(), len((out / "log.csv").read_text().splitlines()) - 1


def test_a_stopped_run_is_finished_as_it_stands_and_can_go_on(pipeline, stopped, tmp_path):
    with pytest.raises(RebodyError, match="holds an unfinished run"):
        load_artifact(stopped)
    # how long the run was to be is what it was begun with
    assert pipeline(stopped, "--resume", "--finish", *length(pipeline, 700)) == 0
    card, rows = card_and_rows(stopped)
    assert f"- Unfinished: stopped after 4 of {TURNS} iterations\n" in card
    assert rows == 4
    training = load_artifact(stopped, pipeline.name).config["training"]
    assert sum(value for name, value in training.items() if name in LENGTHS) == TURNS

    assert pipeline(stopped, "--resume") == 0
    card, rows = card_and_rows(stopped)
    assert "Unfinished" not in card
    assert rows == TURNS
    assert pipeline(tmp_path / "calm") == 0
    assert pipeline.end(stopped) == pipeline.end(tmp_path / "calm")


def test_a_run_can_be_made_longer_and_remembers(pipeline, tmp_path):
    out = tmp_path / "run"
    assert pipeline(out, *length(pipeline, 4)) == 0
    assert "Length" not in card_and_rows(out)[0]
    assert pipeline(out, "--resume") == 0
    card, rows = card_and_rows(out)
    assert rows == TURNS
    assert "iterations 4 until iteration 4, then " in card or "policy_iterations 1 until iteration 4, then " in card
    meta = read_meta(out / "checkpoint")
    assert sum(value for name, value in meta["settings"].items() if name in LENGTHS) == TURNS
    if pipeline.name != "scratch":  # its step sizes go by the length of the run
        assert pipeline(tmp_path / "calm") == 0
        assert pipeline.end(out) == pipeline.end(tmp_path / "calm")


def test_a_stopped_run_can_be_made_shorter(pipeline, stopped):
    assert pipeline(stopped, "--resume", *length(pipeline, 5)) == 0
    card, rows = card_and_rows(stopped)
    assert "Unfinished" not in card
    assert rows == 5


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("tracker", "--iterations 3"),
        ("inference", "--policy-iterations 0"),
        ("inference", "--wander-iterations 0"),
        ("inference", "--joint-iterations 3"),
    ],
)
def test_what_is_done_cannot_be_undone(pipelines, tmp_path, name, words, capsys):
    pipeline, out = pipelines[name], tmp_path / "run"
    assert pipeline(out) == 0
    before = pipeline.end(out)
    assert pipeline(out, "--resume", *words.split()) == 2
    said = capsys.readouterr().err
    assert f"{TURNS} iterations are done" in said
    assert words.split()[0].strip("-").replace("-", "_") in said
    assert pipeline.end(out) == before


def test_there_must_be_something_to_finish(pipelines, tmp_path, capsys):
    assert pipelines["tracker"](tmp_path / "run", "--resume", "--finish") == 2
    assert "holds no checkpoint" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


def test_a_checkpoint_of_an_older_release_goes_on(pipelines, tmp_path, monkeypatch):
    """It says nothing of changes."""
    pipeline, out = pipelines["tracker"], tmp_path / "run"
    dumps = json.dumps

    def without_changes(value, *rest, **more):
        if isinstance(value, dict):
            value = {name: part for name, part in value.items() if name != "changes"}
        return dumps(value, *rest, **more)

    with monkeypatch.context() as patched:
        patched.setattr(json, "dumps", without_changes)
        assert pipeline(out, "--iterations", 4) == 0
    assert "changes" not in read_meta(out / "checkpoint")
    assert pipeline(out, "--resume") == 0
