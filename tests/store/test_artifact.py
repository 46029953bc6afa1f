"""Artifacts come back as they were, or not at all and with a plain message."""

import json
import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.store import artifact, load_artifact, recover, save_artifact, save_checkpoint, shipped_artifacts

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
    with pytest.raises(RebodyError, match=r"Artifacts are: goal-velocity, mine, tracker-cheetah, or a folder"):
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
    (folder / "manifest.json").write_text(json.dumps(manifest | {"format_version": 3}))
    with pytest.raises(RebodyError, match="format version 3; this rebody reads version 2"):
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


def test_a_name_with_a_separator_is_a_folder_of_ones_own(shipped, folder, tmp_path, monkeypatch):
    own = save(tmp_path / "here" / "tracker-cheetah", 3.0, "tracker")
    monkeypatch.chdir(own.parent)
    for reference in ("./tracker-cheetah", "tracker-cheetah/", own, str(own)):
        assert load_artifact(reference).path == own
    assert load_artifact("tracker-cheetah").path == tmp_path / "tracker-cheetah"


def test_an_unfinished_run_says_what_to_do(tmp_path):
    save_checkpoint(tmp_path / "run" / "checkpoint", {"w": np.ones(1)}, {})
    with pytest.raises(RebodyError, match=r"holds an unfinished run: go on with it .* `--resume --finish`"):
        load_artifact(tmp_path / "run")


def test_a_link_that_leaves_the_folder_is_refused(folder, tmp_path):
    (folder / "card.md").rename(tmp_path / "card.md")
    (folder / "card.md").symlink_to(tmp_path / "card.md")
    with pytest.raises(RebodyError, match=r"card\.md is a link that leaves"):
        load_artifact(folder)
    (folder / "kept").mkdir()
    (tmp_path / "card.md").rename(folder / "kept" / "card.md")
    (folder / "card.md").unlink()
    (folder / "card.md").symlink_to("kept/card.md")
    assert bias(folder) == 1.0


@pytest.mark.parametrize("name", sorted(FILES))
def test_a_pipe_is_refused_at_once(folder, name):
    (folder / name).unlink()
    os.mkfifo(folder / name)
    for attempt in (load_artifact, recover, save):
        with pytest.raises(RebodyError, match=f"{name} is a pipe"):
            attempt(folder)
