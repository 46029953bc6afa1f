"""Artifacts come back as they were, or not at all and with a plain message."""

import json
import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.store import artifact, load_artifact, save_artifact, shipped_artifacts

CONFIG = {"fields": ["x", "vx"], "window": 16}
LOG = "iteration,loss\n1,0.5\n"
FILES = {"weights.safetensors", "config.json", "card.md", "log.csv", "manifest.json"}


def save(path: Path, value: float = 1.0, kind: str = "inference") -> Path:
    weights = {"cell.bias": np.full(3, value, np.float32), "seen": np.array(4), "none": np.zeros((0, 2))}
    return save_artifact(path, kind=kind, config=CONFIG, weights=weights, card="# A card\n", log=LOG)


def bias(path: Path) -> float:
    return float(load_artifact(path, "inference").arrays["cell.bias"][0])


@pytest.fixture
def folder(tmp_path):
    return save(tmp_path / "mine")


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    monkeypatch.setattr(artifact, "SHIPPED", tmp_path)
    save(tmp_path / "goal-velocity")
    save(tmp_path / "tracker-cheetah", kind="tracker")


def test_round_trip(folder):
    loaded = load_artifact(folder, "inference")
    assert (loaded.name, loaded.kind, loaded.path) == ("mine", "inference", folder)
    assert (loaded.config, loaded.card, loaded.log) == (CONFIG, "# A card\n", LOG)
    assert loaded.arrays["seen"] == 4
    assert loaded.arrays["none"].shape == (0, 2)
    assert {entry.name for entry in folder.iterdir()} == FILES


def test_shipped_names(shipped):
    assert shipped_artifacts() == [("goal-velocity", "inference"), ("tracker-cheetah", "tracker")]
    assert load_artifact("tracker-cheetah", "tracker").name == "tracker-cheetah"


def test_of_any_kind(shipped, folder):
    assert [load_artifact(each).kind for each in ("tracker-cheetah", folder)] == ["tracker", "inference"]
    with pytest.raises(RebodyError, match=r"Shipped artifacts: goal-velocity, mine, tracker-cheetah\."):
        load_artifact("nowhere")


def test_unknown_name_suggests_and_lists_its_kind(shipped):
    with pytest.raises(RebodyError, match=r"mean 'goal-velocity'\?") as error:
        load_artifact("goal-velocty", "inference")
    assert "tracker-cheetah" not in str(error.value)


def test_wrong_kind(shipped):
    with pytest.raises(RebodyError, match="kind 'tracker'; one of kind 'inference' is needed"):
        load_artifact("tracker-cheetah", "inference")


@pytest.mark.parametrize("name", sorted(FILES))
def test_missing_file(folder, name):
    (folder / name).unlink()
    with pytest.raises(RebodyError, match=f"{name} is missing"):
        load_artifact(folder, "inference")


@pytest.mark.parametrize("name", sorted(FILES - {"manifest.json"}))
def test_one_flipped_bit_in_any_byte_is_found(folder, name, flip):
    data = (folder / name).read_bytes()
    for position in range(0, len(data), 7):
        (folder / name).write_bytes(flip(data, position))
        with pytest.raises(RebodyError, match=f"{name} is damaged"):
            load_artifact(folder, "inference")


def test_a_damaged_manifest_never_gives_another_artifact(folder, flip):
    data = (folder / "manifest.json").read_bytes()
    for position in range(len(data)):
        (folder / "manifest.json").write_bytes(flip(data, position))
        with suppress(RebodyError):
            assert load_artifact(folder, "inference").config == CONFIG  # the bit was in white space


@pytest.mark.parametrize("text", ["{", "[]", "{}"])
def test_broken_manifest(folder, text):
    (folder / "manifest.json").write_text(text)
    with pytest.raises(RebodyError, match=r"manifest\.json is damaged"):
        load_artifact(folder, "inference")


def test_other_format_version(folder):
    manifest = json.loads((folder / "manifest.json").read_text())
    (folder / "manifest.json").write_text(json.dumps(manifest | {"format_version": 2}))
    with pytest.raises(RebodyError, match="format version 2; this rebody reads version 1"):
        load_artifact(folder, "inference")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_non_finite_weights_are_refused(folder, value):
    with pytest.raises(RebodyError, match=r"cell\.bias"):
        save(folder, value)
    assert bias(folder) == 1.0


def test_a_file_is_no_folder(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(RebodyError, match="is a file"):
        save(tmp_path / "file")


def test_replacing_keeps_foreign_files_and_leaves_nothing_behind(folder):
    (folder / "events").mkdir()
    (folder / "events" / "curve").write_text("a curve")
    save(folder, 2.0)
    assert bias(folder) == 2.0
    assert (folder / "events" / "curve").read_text() == "a curve"
    assert list(folder.parent.iterdir()) == [folder]


@pytest.mark.parametrize("failing", ["write", "step aside", "move in"])
def test_failure_midway_leaves_the_old_one(folder, monkeypatch, failing):
    real_rename, real_write = os.rename, Path.write_bytes

    def rename(source, target):
        moving_in = Path(source).name == ".mine.new"
        if (failing == "move in" and moving_in) or (failing == "step aside" and Path(source) == folder):
            raise OSError("no")
        real_rename(source, target)

    def write_bytes(path, data):
        if failing == "write" and path.name == "card.md":
            raise OSError("no")
        return real_write(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(os, "rename", rename)
        patch.setattr(Path, "write_bytes", write_bytes)
        with pytest.raises(OSError, match="no"):
            save(folder, 2.0)
    assert bias(folder) == 1.0
    assert list(folder.parent.iterdir()) == [folder]


def test_killed_between_the_renames_the_old_one_is_read_and_the_next_save_mends(folder):
    folder.rename(folder.with_name(".mine.old"))
    save(folder.with_name(".mine.new"), 9.0)
    assert bias(folder) == 1.0
    assert load_artifact(folder, "inference").name == "mine"
    save(folder, 2.0)
    assert bias(folder) == 2.0
    assert list(folder.parent.iterdir()) == [folder]
