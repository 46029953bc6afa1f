"""Folders change in one step, wherever they lie and whenever a save is killed, and are one process's at a time."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from rebody.errors import RebodyError
from rebody.store import folders, load_artifact, recover, save_artifact, take_folder
from rebody.store.artifact import HASHED, MANIFEST
from rebody.store.folders import LOCK, STAGE, try_folder

FILES = {*HASHED, MANIFEST}


def save(path: Path, value: float) -> Path:
    weights = {"w": np.full(3, value)}
    config, card, log = {"value": value}, f"# {value}\n", f"iteration\n{value}\n"
    return save_artifact(path, kind="tracker", config=config, weights=weights, card=card, log=log)


def value(path: Path) -> float:
    """That all parts agree on."""
    loaded = load_artifact(path)
    told = loaded.config["value"]
    assert (loaded.arrays["w"] == told).all()
    assert (loaded.card, loaded.log) == (f"# {told}\n", f"iteration\n{told}\n")
    return told


def names(path: Path) -> set[str]:
    return {entry.name for entry in path.iterdir()}


@pytest.fixture
def folder(tmp_path):
    return save(tmp_path / "mine", 1.0)


KILLED = """
import os, signal, sys
from pathlib import Path
sys.path.insert(0, sys.argv[1])
import test_folders

def killed_at(number, path):
    seen = 0
    def count(event, arguments):
        nonlocal seen
        if event in ("open", "os.mkdir", "os.rename", "os.remove", "os.rmdir", "shutil.rmtree"):
            seen += 1
            if seen == number:
                os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(count)
    test_folders.save(path, 2.0)
    os._exit(0)

for number in range(1, 100):
    path = Path(sys.argv[2]) / str(number)
    if os.fork() == 0:
        killed_at(number, path)
    if os.wait()[1] == 0:
        break
"""
"""Saves into one folder after another, and is killed at the first, second, ... call that touches a file."""


def test_killed_at_any_moment_the_old_one_is_whole_or_the_new_one(tmp_path):
    for number in range(1, 100):
        save(tmp_path / str(number), 1.0)
    subprocess.run([sys.executable, "-c", KILLED, str(Path(__file__).parent), str(tmp_path)], check=True)
    found = []
    for number in range(1, 100):
        path = tmp_path / str(number)
        found.append(value(path))
        recover(path)
        assert value(path) == found[-1]
        assert names(path) == FILES
    commit = found.index(2.0)
    assert commit > 10
    assert found[commit : commit + len(FILES)] == [2.0] * len(FILES)  # the others follow one by one
    assert found[-1] == 1.0  # so many calls there are not


def test_a_killed_save_into_a_new_folder_leaves_no_artifact(tmp_path, folder):
    (tmp_path / "new").mkdir()
    folder.rename(tmp_path / "new" / STAGE)
    with pytest.raises(RebodyError, match=r"manifest\.json is missing"):
        load_artifact(tmp_path / "new")
    recover(tmp_path / "new")
    assert names(tmp_path / "new") == set()


def test_whoever_reads_while_others_save_finds_one_or_the_other(folder):
    done = threading.Event()

    def save_again_and_again():
        for i in range(2, 60):
            save(folder, float(i))
        done.set()

    saving = threading.Thread(target=save_again_and_again)
    saving.start()
    found = []
    while not done.is_set():
        found.append(value(folder))
    saving.join()
    assert found == sorted(found)
    assert value(folder) == 59.0


def test_links_are_followed(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere" / "real")  # to nothing yet
    save(tmp_path / "link", 1.0)
    assert save(tmp_path / "link", 2.0) == tmp_path / "link"
    assert (tmp_path / "link").is_symlink()
    assert value(tmp_path / "elsewhere" / "real") == value(tmp_path / "link") == 2.0
    assert names(tmp_path / "elsewhere" / "real") == FILES
    assert names(tmp_path / "elsewhere") == {"real"}


def test_nothing_beside_the_folder_is_touched(folder, monkeypatch):
    """A mount point cannot be renamed, and where it lies nothing may be written."""
    touched = []
    real = os.replace
    monkeypatch.setattr(os, "replace", lambda *paths: touched.extend(paths) or real(*paths))
    monkeypatch.setattr(os, "rename", None)
    save(folder, 2.0)
    assert value(folder) == 2.0
    assert all(path.is_relative_to(folder) and path != folder for path in touched)


def test_a_full_disk_is_one_message_and_leaves_the_old_one(folder, little_space):
    with little_space(200), pytest.raises(RebodyError, match=r"the artifact .* cannot be written: .*too large\.$"):
        save(folder, 2.0)
    assert value(folder) == 1.0
    assert names(folder) == FILES


def test_a_failure_after_the_commit_loses_nothing(folder, monkeypatch):
    real = os.replace

    def replace(source, target):
        if target.name == "log.csv":
            raise OSError(5, "Input/output error")
        real(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", replace)
        with pytest.raises(RebodyError, match="Input/output error"):
            save(folder, 2.0)
    assert value(folder) == 2.0
    save(folder, 3.0)
    assert value(folder) == 3.0
    assert names(folder) == FILES


def test_a_folder_is_one_process_s_until_it_ends(tmp_path):
    folder = tmp_path / "run"
    holder = (
        "import sys, time, pathlib; from rebody.store import take_folder; "
        "lock = take_folder(pathlib.Path(sys.argv[1])); print('taken', flush=True); time.sleep(60)"
    )
    process = subprocess.Popen([sys.executable, "-c", holder, str(folder)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"taken\n"
    with pytest.raises(RebodyError, match=f"another run writes to {folder}"):
        take_folder(folder)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    take_folder(folder).close()
    take_folder(folder).close()
    assert names(folder) == {LOCK}


def test_without_locks_it_is_not_told_apart(tmp_path, monkeypatch):
    monkeypatch.setattr(folders, "fcntl", None)
    with take_folder(tmp_path), take_folder(tmp_path):
        pass


@pytest.mark.parametrize("failing", ["replace", "fsync"])
def test_a_folder_that_cannot_be_saved_to_is_found_before(tmp_path, monkeypatch, failing):
    def fail(*_):
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(os, failing, fail)
    for attempt in (take_folder, try_folder):
        with pytest.raises(RebodyError, match=f"folder {tmp_path} cannot be written to: Read-only file system"):
            attempt(tmp_path)
    assert names(tmp_path) == {LOCK}


def test_so_is_a_full_disk(tmp_path, little_space):
    with little_space(100), pytest.raises(RebodyError, match="cannot be written to"):
        try_folder(tmp_path)
    assert names(tmp_path) == set()
