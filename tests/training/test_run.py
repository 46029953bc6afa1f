"""Training runs lose nothing: killed, interrupted, diverged, resumed."""

import csv
import io
import os
import re
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import tensorboardX.proto.event_pb2
from rich.markdown import Markdown

from rebody.store import load_artifact, tree_hash
from rebody.training.run import Run, read_log

LIVES = (0, 0, 1, 1, 1)
"""The turn in which each life of a killed run ends; at most eight turns are done by then."""
TURNS = 9


@pytest.fixture(scope="module")
def graveyard(pipelines, tmp_path_factory):
    """Runs that are killed at random moments: their folder, and processes that say how each life ended."""
    folder = tmp_path_factory.mktemp("killed")
    rng = np.random.default_rng(7)
    environment = os.environ | {"JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    processes = {}
    for name, pipeline in pipelines.items():
        moments = rng.permutation(LIVES) + rng.random(len(LIVES)).round(3)
        script = [sys.executable, Path(__file__).with_name("killed.py"), ",".join(map(str, moments))]
        command = [*script, *pipeline.arguments, "--out", folder / name]
        processes[name] = subprocess.Popen(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
    yield folder, processes
    for process in processes.values():
        process.kill()
        process.communicate()


def test_killed_at_random_moments_it_ends_as_if_nothing_had_been(graveyard, pipeline, tmp_path, read_checkpoint):
    folder, processes = graveyard
    assert pipeline(tmp_path / "calm") == 0
    exit_codes, complaints = processes[pipeline.name].communicate(timeout=300)
    assert exit_codes.split() == len(LIVES) * [str(-signal.SIGKILL)], complaints
    killed = folder / pipeline.name
    assert sum(LIVES) <= read_checkpoint(killed)["iteration"] < TURNS
    assert not (killed / "manifest.json").exists()
    assert pipeline(killed, "--resume") == 0
    assert pipeline.end(killed) == pipeline.end(tmp_path / "calm")
    assert logged(killed) == logged(tmp_path / "calm")


def logged(out):
    """Rows of a finished run's log."""
    return list(csv.DictReader(io.StringIO((out / "log.csv").read_text())))


def test_ctrl_c_saves_first_and_says_how_to_go_on(pipeline, tmp_path, after_turn, read_checkpoint, capsys):
    assert pipeline(tmp_path / "calm") == 0
    handler = signal.getsignal(signal.SIGINT)
    after_turn(2, lambda: signal.raise_signal(signal.SIGINT))
    out = tmp_path / "interrupted"
    assert pipeline(out) == 130
    assert signal.getsignal(signal.SIGINT) is handler
    said = capsys.readouterr().err
    assert "--resume" in said
    assert str(out) in said
    assert "Traceback" not in said
    assert not (out / "manifest.json").exists()
    assert read_checkpoint(out)["iteration"] == 2
    assert pipeline(out, "--resume") == 0
    assert pipeline.end(out) == pipeline.end(tmp_path / "calm")
    assert logged(out) == logged(tmp_path / "calm")
    # TensorBoard forgets what an earlier life told of turns that are taken again
    begins = [event.step for event in events(out / "events") if event.HasField("session_log")]
    assert begins[-1] == 3  # a life that begins within the same second writes over the file of the one before


def test_a_seed_decides_everything(pipeline, tmp_path):
    ends = []
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        assert pipeline(tmp_path / name, "--seed", seed) == 0
        ends.append(pipeline.end(tmp_path / name))
    assert ends[0] == ends[1]
    assert ends[0][0] != ends[2][0]


def test_resuming_a_finished_run_changes_nothing(pipeline, tmp_path):
    assert pipeline(tmp_path / "run") == 0
    before = pipeline.end(tmp_path / "run")
    assert pipeline(tmp_path / "run", "--resume") == 0
    assert pipeline.end(tmp_path / "run") == before


def test_a_folder_that_holds_a_run_is_refused(pipeline, tmp_path, capsys):
    out = tmp_path / "run"
    assert pipeline(out) == 0
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    assert pipeline(out, "--seed", 1) == 2
    assert "already holds a run. Add --resume" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before


def test_a_file_is_no_folder_for_a_run(pipeline, tmp_path, capsys):
    (tmp_path / "file").write_text("mine")
    assert pipeline(tmp_path / "file") == 2
    assert "is a file" in capsys.readouterr().err
    assert (tmp_path / "file").read_text() == "mine"


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        (["--seed", "1"], "(seed)"),
        (["--sac.discount", "0.5", "--seed", "1"], "(sac, seed)"),
        (["--init-from", "{run}"], "(init_from)"),
        (["--sac.hidden", "8", "9"], "(sac)"),
    ],
)
def test_other_settings_are_not_resumed(pipeline, tmp_path, changes, named, capsys):
    out = tmp_path / "run"
    assert pipeline(out) == 0
    before = pipeline.end(out)
    assert pipeline(out, "--resume", *(change.format(run=out) for change in changes)) == 2
    said = capsys.readouterr().err
    assert "begun with other settings" in said
    assert named in said
    assert pipeline.end(out) == before


def untrained(pipeline):
    """What makes a run take no turn at all."""
    if pipeline.name != "inference":
        return ["--iterations", 0]
    return ["--wander-iterations", 0, "--joint-iterations", 0, "--policy-iterations", 0]


def test_a_run_can_start_from_the_networks_of_an_artifact(pipeline, tmp_path, monkeypatch):
    assert pipeline(tmp_path / "first") == 0
    first = pipeline.weights(tmp_path / "first")

    begun = []
    iterate = pipeline.train.iterate
    monkeypatch.setattr(pipeline.train, "iterate", lambda state, *rest: begun.append(state) or iterate(state, *rest))
    assert pipeline(tmp_path / "second", "--seed", 1, "--init-from", tmp_path / "first") == 0
    actor = {"inference": "high_level.actor.", "scratch": "policy.actor."}.get(pipeline.name, "actor.")
    wanted = {name.removeprefix(actor): array for name, array in first.items() if name.startswith(actor)}
    assert len(begun) == TURNS
    assert tree_hash(begun[0].sac.actor) == tree_hash(begun[0].sac.averaged_actor) == tree_hash(wanted)
    if pipeline.name in ("inference", "scratch"):
        module = {name.removeprefix("module."): a for name, a in first.items() if name.startswith("module.")}
        assert tree_hash(begun[0].module) == tree_hash(module)
    assert tree_hash(pipeline.weights(tmp_path / "second")) != tree_hash(first)

    # without a turn, the artifact is what the run started from
    assert pipeline(tmp_path / "third", "--seed", 2, "--init-from", tmp_path / "first", *untrained(pipeline)) == 0
    third = pipeline.weights(tmp_path / "third")
    assert third.keys() == first.keys()
    for name in first:
        if not name.startswith("probe."):  # fitted anew
            np.testing.assert_array_equal(third[name], first[name], err_msg=name)


@pytest.mark.parametrize("sizes", [["--sac.hidden", "8", "9"], ["--sac.hidden", "8"], ["--sac.projections", "3"]])
def test_networks_of_other_sizes_are_refused(pipeline, tmp_path, sizes, capsys):
    assert pipeline(tmp_path / "first", *untrained(pipeline)) == 0
    assert pipeline(tmp_path / "second", "--init-from", tmp_path / "first", *sizes) == 2
    assert "its networks have other sizes than these settings" in capsys.readouterr().err
    assert not (tmp_path / "second").exists()


def test_an_encoder_of_another_window_is_refused(pipelines, tmp_path, capsys):
    pipeline = pipelines["inference"]
    assert pipeline(tmp_path / "first", *untrained(pipeline)) == 0
    assert pipeline(tmp_path / "second", "--init-from", tmp_path / "first", "--inference.window", 5) == 2
    assert "cannot start from" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("name", "rate"), [("tracker", "--sac.learning-rate=1e30"), ("inference", "--inference.learning-rate=nan")]
)
def test_divergence_leaves_no_artifact(pipelines, tmp_path, name, rate, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)  # MuJoCo may leave a log of its warnings
    monkeypatch.setattr("rebody.ranges._wanted", lambda *_: "")  # it would be refused before
    assert pipelines[name](tmp_path / "run", rate) == 2
    said = capsys.readouterr().err
    assert "diverged" in said
    assert "Traceback" not in said
    assert not (tmp_path / "run" / "manifest.json").exists()


def test_the_checkpoint_before_divergence_is_intact(pipeline, tmp_path, monkeypatch, read_checkpoint, capsys):
    assert pipeline(tmp_path / "calm") == 0
    monkeypatch.setattr(pipeline.train, "Run", partial(Run, checkpoint_every_s=-1.0))
    iterate, out = pipeline.train.iterate, tmp_path / "run"

    def fault(state, *rest):
        state, metrics = iterate(state, *rest)
        return state, metrics | ({"critic_loss": float("nan")} if state.iteration == 3 else {})

    with monkeypatch.context() as patched:
        patched.setattr(pipeline.train, "iterate", fault)
        assert pipeline(out) == 2
    said = capsys.readouterr().err
    assert "training diverged: not finite: critic_loss" in said
    assert str(out) in said
    assert read_checkpoint(out)["iteration"] == 2
    assert pipeline(out, "--resume") == 0
    assert pipeline.end(out) == pipeline.end(tmp_path / "calm")


def test_a_state_that_is_not_finite_never_replaces_a_checkpoint(
    pipeline, tmp_path, monkeypatch, read_checkpoint, capsys
):
    """The last update of a turn can break the weights while every loss so far was finite."""
    monkeypatch.setattr(pipeline.train, "Run", partial(Run, checkpoint_every_s=-1.0))
    iterate, out = pipeline.train.iterate, tmp_path / "run"

    def fault(state, *rest):
        state, metrics = iterate(state, *rest)
        if state.iteration == 3:
            state = eqx.tree_at(lambda s: s.sac.log_temperature, state, jnp.asarray(jnp.nan))
        return state, metrics

    monkeypatch.setattr(pipeline.train, "iterate", fault)
    assert pipeline(out) == 2
    assert "training diverged: not finite: sac.log_temperature." in capsys.readouterr().err
    assert read_checkpoint(out)["iteration"] == 2
    assert not (out / "manifest.json").exists()


def events(folder):
    """Every event in the TensorBoard files of a folder."""
    for path in sorted(folder.glob("events.out.tfevents.*")):
        data = path.read_bytes()
        while data:
            size = int.from_bytes(data[:8], "little")  # a length, its checksum, the event, its checksum
            yield tensorboardX.proto.event_pb2.Event.FromString(data[12 : 12 + size])
            data = data[16 + size :]


def test_curves_are_written_for_tensorboard_and_as_csv(pipeline, tmp_path):
    assert pipeline(tmp_path / "run") == 0
    curves = {}
    for event in events(tmp_path / "run" / "events"):
        for value in event.summary.value:
            curves.setdefault(value.tag, {})[event.step] = value.simple_value
    assert {"critic_loss", "actor_loss", "temperature", "entropy", "value"} <= curves.keys()
    begin = 2 if pipeline.name == "inference" else 1  # while all toys wander, no policy learns
    assert list(curves["critic_loss"]) == list(range(begin, TURNS + 1))
    assert all(np.isfinite(list(curve.values())).all() for curve in curves.values())

    rows = logged(tmp_path / "run")
    assert [row["iteration"] for row in rows] == [str(i + 1) for i in range(TURNS)]
    assert rows[0].keys() == {"iteration", *curves}
    for name, curve in curves.items():
        measured = {i: float(row[name]) for i, row in enumerate(rows, 1) if row[name]}
        assert measured == pytest.approx(curve, rel=1e-5), name
    assert load_artifact(tmp_path / "run", pipeline.name).log == (tmp_path / "run" / "log.csv").read_text()


def test_a_log_has_a_row_per_iteration_and_a_column_per_name(tmp_path):
    run = Run(tmp_path / "run", {})
    assert run.log == "iteration\n"
    run.history = [{"loss": 0.5}, {"loss": 1234567.0, "evaluation/p95, m": -1.0}, {"entropy": 1e-9}]
    assert run.log == 'iteration,loss,"evaluation/p95, m",entropy\n1,0.5,,\n2,1.23457e+06,-1,\n3,,,1e-09\n'
    columns = read_log(run.log)
    np.testing.assert_array_equal(columns["iteration"], [1, 2, 3])
    np.testing.assert_array_equal(columns["evaluation/p95, m"], [np.nan, -1, np.nan])


def test_the_card_says_how_it_was_made(pipeline, tmp_path, monkeypatch, capsys):
    out = tmp_path / "a run"
    arguments = [*pipeline.arguments, "--out", str(out), "--seed", "5"]
    monkeypatch.setattr(sys, "argv", ["rebody", *arguments])
    assert pipeline(out, "--seed", 5) == 0
    card = (out / "card.md").read_text()
    quoted = " ".join(f"'{word}'" if " " in word else word for word in arguments)
    assert f"- Made by: `rebody {quoted}`\n" in card
    assert "- Seed: 5\n" in card
    assert re.search(r"- Training time: 0\.\d minutes\n", card)
    assert "rebody 0.1.0, JAX " in card
    assert [token.type for token in Markdown(card).parsed].count("tr_open") >= 4
    assert card in capsys.readouterr().out


def test_training_time_adds_up_over_resumptions(pipeline, tmp_path, monkeypatch, after_turn):
    out = tmp_path / "run"
    after_turn(2, lambda: signal.raise_signal(signal.SIGINT))
    with monkeypatch.context() as patched:
        save = Run._save

        def save_after_two_hours(self, state):
            self.wall_s += 7200
            save(self, state)

        patched.setattr(Run, "_save", save_after_two_hours)
        assert pipeline(out) == 130
    assert pipeline(out, "--resume") == 0
    assert "- Training time: 120." in (out / "card.md").read_text()
