"""A run's folder: its own, tried before training, wherever a link leads, and whole when the disk is full."""

import re
from functools import partial
from types import SimpleNamespace

import pytest
import safetensors.numpy
from safetensors import SafetensorError
from tensorboardX.record_writer import RecordWriter

from rebody.errors import RebodyError
from rebody.store import take_folder
from rebody.training.run import Run


@pytest.fixture
def tracker(pipelines, monkeypatch):
    """A pipeline that saves a checkpoint after each turn."""
    monkeypatch.setattr(pipelines["tracker"].train, "Run", partial(Run, checkpoint_every_s=-1.0))
    return pipelines["tracker"]


def test_two_runs_do_not_share_a_folder(tracker, tmp_path, capsys):
    out = tmp_path / "run"
    with take_folder(out):
        assert tracker(out) == 2
        assert f"another run writes to {out}" in capsys.readouterr().err
    assert tracker(out) == 0
    with take_folder(out):
        assert tracker(out, "--resume") == 2
    assert tracker(out, "--resume") == 0


def test_a_folder_of_another_run_that_ended_meanwhile_is_refused(tmp_path):
    with Run(tmp_path / "run", {"iterations": 1}) as late:
        (tmp_path / "run" / "checkpoint").mkdir(parents=True)
        with pytest.raises(RebodyError, match="already holds a run"):
            late.restore(SimpleNamespace(iteration=0))


def test_what_cannot_be_saved_is_said_before_training(tracker, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(tracker.train, "iterate", None)
    out = tmp_path / "run"
    (out / "card.md").mkdir(parents=True)
    assert tracker(out) == 2
    assert "card.md is a folder" in capsys.readouterr().err
    assert tracker("/proc/run") == 2
    assert "the folder /proc/run cannot be written to" in capsys.readouterr().err


def test_so_is_a_disk_that_has_no_room_for_checkpoints(tracker, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("shutil.disk_usage", lambda folder: SimpleNamespace(free=100_000))
    monkeypatch.setattr(tracker.train, "iterate", None)
    assert tracker(tmp_path / "run", "--replay", 1000) == 2
    assert re.search(r"needs 0\.\d MB, and its disk has 0\.1 MB left", capsys.readouterr().err)


def test_a_link_is_followed(tracker, tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "disk" / "run")
    assert tracker(tmp_path / "link") == 0
    assert tracker(tmp_path / "link", "--resume") == 0
    assert (tmp_path / "link").is_symlink()
    assert tracker.end(tmp_path / "disk" / "run") == tracker.end(tmp_path / "link")
    assert {entry.name for entry in tmp_path.iterdir()} == {"link", "disk"}


@pytest.mark.parametrize("full_for", ["checkpoint", "curves"])
def test_a_full_disk_is_one_message_and_the_checkpoint_stays(
    tracker, tmp_path, full_for, monkeypatch, read_checkpoint, capsys
):
    assert tracker(tmp_path / "calm") == 0
    calls = []

    def full(error, real, *arguments, **more):
        calls.append(1)
        if len(calls) > 3:
            raise error
        return real(*arguments, **more)

    out = tmp_path / "run"
    with monkeypatch.context() as patched:
        if full_for == "checkpoint":
            error = SafetensorError("Error while serializing: I/O error: No space left on device (os error 28)")
            patched.setattr(safetensors.numpy, "save_file", partial(full, error, safetensors.numpy.save_file))
        else:
            error, real = OSError(28, "No space left on device"), RecordWriter.flush
            patched.setattr(RecordWriter, "flush", lambda self: full(error, real, self))
        assert tracker(out) == 2
    said = capsys.readouterr().err
    assert "cannot be written" in said
    assert "No space left on device" in said
    assert "--resume" in said
    assert read_checkpoint(out)["iteration"] in (3, 4)
    assert tracker(out, "--resume") == 0
    assert tracker.end(out) == tracker.end(tmp_path / "calm")
