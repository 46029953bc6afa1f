"""Outputs are tried before the work, follow links, and never take the place of what is read."""

import json
import os
import shutil
from pathlib import Path

import pytest

from rebody.cli.main import run
from rebody.cli.output import check_output
from rebody.errors import RebodyError
from rebody.store.artifact import SHIPPED


@pytest.fixture
def tasks(tmp_path: Path) -> Path:
    path = tmp_path / "tasks.json"
    path.write_text(json.dumps([{"family": "goal", "target": 1.5}]))
    return path


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys):
    """A function (command line, words of the message): it is refused before any part is loaded; nothing changes."""
    monkeypatch.chdir(tmp_path)

    def found():
        return {path: path.lstat().st_ino for path in tmp_path.rglob("*")}

    def refused(words, said):
        before = found()
        assert run([*words.split(), "--inference", "never-looked-at"]) == 2
        assert said in capsys.readouterr().err
        assert found() == before

    return refused


def test_an_output_is_never_an_input(tasks, refused, tmp_path):
    text = tasks.read_text()
    (tmp_path / "link.json").symlink_to(tasks)
    os.link(tasks, tmp_path / "reuse.json")
    (tmp_path / "robot.toml").write_text("frame_skip = 1")
    for name in ("tasks.json", "./tasks.json", "link.json", "reuse.json"):
        refused(f"evaluate --tasks tasks.json --json {name}", "would write over what is read")
    refused("evaluate --tasks tasks.json --robot robot.toml --json robot.toml", "would write over what is read")
    refused("diagnose --tasks tasks.json --out .", "would write over what is read")
    assert tasks.read_text() == text


def test_nor_a_part_of_an_artifact(tasks, refused, tmp_path):
    shutil.copytree(SHIPPED / "position", tmp_path / "own")
    for name in ("config", "manifest"):
        refused(f"evaluate --tasks tasks.json --json own/{name}.json", "is a part of the artifact")


def test_only_regular_files_are_outputs(tasks, refused, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "device").symlink_to("/dev/null")
    for name, kind in (("pipe", "a pipe"), ("device", "a device"), ("/dev/null", "a device"), (".", "a folder")):
        refused(f"evaluate --tasks tasks.json --json {name}", f"is {kind}; name a regular file")


def test_a_folder_that_cannot_be_written_to_is_found_before(tasks, refused):
    refused("evaluate --tasks tasks.json --json /proc/out.json", "the folder /proc cannot be written to")
    refused("evaluate --tasks tasks.json --json /proc/new/folder/out.json", "the folder /proc cannot be written to")


def test_every_command_that_writes_tries_before(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for words in (
        "demo --out /proc/demo",
        "figure 6.9 --out /proc/figures",
        "run --task goal=1 --figure /proc/a.png",
        "run --task goal=1 --video /proc/a.mp4",
        "report position --out /proc/a.html",
    ):
        assert run(words.split()) == 2
        assert "/proc cannot be written to" in capsys.readouterr().err


def test_links_are_followed(tasks, tmp_path):
    (tmp_path / "link.json").symlink_to(tmp_path / "elsewhere" / "out")
    words = ["--robot", "point-mass", "--inference", "position", "--tasks", str(tasks), "--seconds", "3"]
    for _ in range(2):
        assert run(["evaluate", *words, "--json", str(tmp_path / "link.json")]) == 0
        assert (tmp_path / "link.json").is_symlink()
        assert json.loads((tmp_path / "elsewhere" / "out").read_text())["robot"] == "point-mass"


def test_what_is_tried_leaves_nothing_behind(tmp_path):
    check_output(tmp_path / "new" / "file.json", "--json", inputs=("nowhere", tmp_path))
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    with pytest.raises(RebodyError, match="file is a file, not a folder"):
        check_output(tmp_path / "file" / "file.json", "--json")


@pytest.mark.parametrize("kind", ["pipe", "folder", "large", "mark"])
def test_task_files_are_regular_and_may_have_a_byte_order_mark(tmp_path, capsys, kind, tasks):
    path = tmp_path / "special.json"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    else:
        path.write_bytes(b"\xef\xbb\xbf" + tasks.read_bytes() + (bytes(17_000_000) if kind == "large" else b""))
    code = run(f"evaluate --robot point-mass --inference position --seconds 3 --tasks {path}".split())
    said = {"pipe": "is a pipe", "folder": "is a folder", "large": "is larger than 16 MB", "mark": ""}[kind]
    assert said in capsys.readouterr().err
    assert code == (0 if kind == "mark" else 2)


def test_so_are_the_files_of_robots(tmp_path, capsys):
    os.mkfifo(tmp_path / "own.toml")
    assert run(["robot", "check", str(tmp_path / "own.toml")]) == 2
    assert "is a pipe" in capsys.readouterr().err
