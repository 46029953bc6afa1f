"""A checkpoint is the old one or the new one, whole, whatever happens."""

import json
import os
import signal
import struct
import subprocess
import sys
import time

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import safetensors.numpy

from rebody.errors import RebodyError
from rebody.store import checkpoint, load_checkpoint, read_meta, save_checkpoint, tree_hash, tree_to_arrays

META = {"step": 3, "best": float("-inf"), "name": "run"}


def state(value: float = 1.0):
    return {"weights": jnp.full(3, value), "replay": np.full((5, 2), value), "key": jax.random.key(7)}


@pytest.fixture
def folder(tmp_path):
    save_checkpoint(tmp_path / "run", state(), META)
    return tmp_path / "run"


def test_round_trip(folder):
    save_checkpoint(folder, state(2.0), META | {"step": 4})
    restored, meta = load_checkpoint(folder, state(0.0))
    assert meta == META | {"step": 4}
    assert tree_hash(restored) == tree_hash(state(2.0))
    assert [entry.name for entry in folder.iterdir()] == [checkpoint.FILE]


def test_what_lies_beside_the_state_is_read_alone(folder, tmp_path):
    assert read_meta(folder) == META
    assert read_meta(tmp_path / "nowhere") is None


def test_restored_state_can_be_written_to_without_touching_the_file(folder):
    restored, _ = load_checkpoint(folder, state())
    restored["replay"][:] = 9.0
    assert load_checkpoint(folder, state())[0]["replay"][0, 0] == 1.0


def test_none_where_there_is_none(tmp_path):
    assert load_checkpoint(tmp_path / "nowhere", state()) is None


def test_one_flipped_bit_in_any_byte_is_found(folder, flip):
    path = folder / checkpoint.FILE
    data = path.read_bytes()
    for position in range(len(data)):
        path.write_bytes(flip(data, position))
        try:
            restored, meta = load_checkpoint(folder, state())  # the bit was in the header's padding
            assert (tree_hash(restored), meta) == (tree_hash(state()), META)
        except RebodyError:
            continue


@pytest.mark.parametrize("length", [0, 4, 100, -1])
def test_a_cut_file_is_found(folder, length):
    path = folder / checkpoint.FILE
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(RebodyError, match="is damaged"):
        load_checkpoint(folder, state())


@pytest.mark.parametrize("meta", ["null", "[]", "3", "", "{", "[" * 100_000])
def test_what_is_no_object_is_damaged(meta, folder):
    arrays = tree_to_arrays(state())
    header = {"format_version": "1", "meta": meta, "sha256": checkpoint._sha256(arrays, meta)}
    safetensors.numpy.save_file(arrays, folder / checkpoint.FILE, metadata=header)
    with pytest.raises(RebodyError, match="is damaged"):
        load_checkpoint(folder, state())


@pytest.mark.parametrize(("dtype", "size"), [("BF16", 2), ("F8_E4M3", 1), ("C64", 8)])
def test_types_that_are_never_stored_are_refused(dtype, size, folder):
    described = {"w": {"dtype": dtype, "shape": [1], "data_offsets": [0, size]}}
    header = json.dumps(described | {"__metadata__": {"format_version": "1"}}).encode()
    (folder / checkpoint.FILE).write_bytes(struct.pack("<Q", len(header)) + header + bytes(size))
    with pytest.raises(RebodyError, match="is damaged"):
        load_checkpoint(folder, state())


def test_other_settings_and_other_versions_are_named(folder, monkeypatch):
    with pytest.raises(RebodyError, match=r"checkpoint .* does not fit .*: more is missing"):
        load_checkpoint(folder, state() | {"more": np.zeros(1)})
    monkeypatch.setattr(checkpoint, "FORMAT_VERSION", "2")
    with pytest.raises(RebodyError, match="not written by this version"):
        load_checkpoint(folder, state())


def test_failure_midway_leaves_the_old_one(folder, monkeypatch):
    def replace(source, target):
        raise OSError("no")

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", replace)
        with pytest.raises(RebodyError, match="cannot be written: no"):
            save_checkpoint(folder, state(2.0), META)
    assert tree_hash(load_checkpoint(folder, state())[0]) == tree_hash(state())
    assert [entry.name for entry in folder.iterdir()] == [checkpoint.FILE]


def test_a_full_disk_is_one_message_and_leaves_the_old_one(folder, little_space):
    large = state() | {"replay": np.zeros(100_000)}
    with little_space(4096), pytest.raises(RebodyError, match=r"cannot be written: .*\. Any earlier one is whole"):
        save_checkpoint(folder, large, META)
    assert tree_hash(load_checkpoint(folder, state())[0]) == tree_hash(state())
    assert [entry.name for entry in folder.iterdir()] == [checkpoint.FILE]


def test_a_pipe_is_refused_at_once(folder):
    (folder / checkpoint.FILE).unlink()
    os.mkfifo(folder / checkpoint.FILE)
    with pytest.raises(RebodyError, match="is a pipe"):
        load_checkpoint(folder, state())


ENDLESS = """
import sys, itertools, pathlib, numpy as np
from rebody.store import save_checkpoint
for step in itertools.count():
    save_checkpoint(pathlib.Path(sys.argv[1]), {"a": np.full(500_000, float(step))}, {"step": step})
"""


def test_killed_while_writing_leaves_a_whole_one(tmp_path):
    process = subprocess.Popen([sys.executable, "-c", ENDLESS, str(tmp_path)])
    deadline = time.monotonic() + 60
    while not (tmp_path / checkpoint.FILE).exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    process.wait()
    restored, meta = load_checkpoint(tmp_path, {"a": np.zeros(500_000)})
    assert (restored["a"] == meta["step"]).all()
