"""Files are read and written whole or not at all, and regular ones only."""

import errno
import os
import socket
from pathlib import Path

import pytest

from rebody.errors import RebodyError
from rebody.store.files import check_file, read_file, written_whole


def write(path, text="whole"):
    with written_whole(path) as unfinished:
        unfinished.write_text(text)


def test_becomes_the_file_at_the_end(tmp_path):
    path = tmp_path / "new" / "file.txt"
    with written_whole(path) as unfinished:
        unfinished.write_text("whole")
        assert not path.exists()
    assert path.read_text() == "whole"
    assert list(path.parent.iterdir()) == [path]


def write_half(path):
    with written_whole(path) as unfinished:
        unfinished.write_text("ne")
        raise ValueError("broken")


def test_a_failure_leaves_the_file_as_it_was(tmp_path):
    path = tmp_path / "file.txt"
    path.write_text("old")
    with pytest.raises(ValueError, match="broken"):
        write_half(path)
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_full_disk_is_one_message(tmp_path, little_space):
    path = tmp_path / "file.txt"
    path.write_text("old")
    with little_space(4096), pytest.raises(RebodyError, match=r"file\.txt cannot be written: .* too large\.$"):
        write(path, 5000 * "a")
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_links_are_followed(tmp_path):
    link, target = tmp_path / "link.txt", tmp_path / "elsewhere" / "file"
    link.symlink_to(target)  # to nothing yet
    for text in ("first", "second"):
        write(link, text)
        assert link.is_symlink()
        assert target.read_text() == text
    assert list(target.parent.iterdir()) == [target]


def test_a_link_in_the_way_of_the_unfinished_file_is_not_followed(tmp_path):
    (tmp_path / "mine").write_text("mine")
    (tmp_path / ".file.new.txt").symlink_to(tmp_path / "mine")
    write(tmp_path / "file.txt")
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_file_that_is_a_mount_point_is_written_to(tmp_path, monkeypatch):
    def replace(source, target):
        raise OSError(errno.EBUSY, "Device or resource busy")

    path = tmp_path / "file.txt"
    path.write_text("old")
    monkeypatch.setattr(os, "replace", replace)
    write(path, "new")
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.fixture(params=["a pipe", "a socket", "a folder", "a device"])
def special(request, tmp_path):
    """What is no regular file, and how it is called."""
    path = tmp_path / "special"
    if request.param == "a pipe":
        os.mkfifo(path)
    elif request.param == "a folder":
        path.mkdir()
    elif request.param == "a device":
        path.symlink_to("/dev/null")
    else:
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(os.path.relpath(path))  # names of sockets are short
    return path, request.param


def test_only_regular_files_are_written(special):
    path, kind = special
    before = path.lstat()
    with pytest.raises(RebodyError, match=f"special is {kind}; name a regular file"):
        write(path)
    assert path.lstat() == before


def test_only_regular_files_are_read_and_pipes_do_not_block(special):
    path, kind = special
    with pytest.raises(RebodyError, match=f"special is {kind}; a regular file is needed"):
        read_file(path, 100)


def test_sizes_have_a_limit(tmp_path):
    path = tmp_path / "file"
    path.write_bytes(bytes(100))
    assert read_file(path, 100) == bytes(100)
    with pytest.raises(RebodyError, match=r"is larger than 9\.9e-05 MB"):
        read_file(path, 99)
    with pytest.raises(RebodyError, match="too large"):
        read_file(Path("/proc/self/status"), 10)  # its size is said to be 0


def test_links_that_leave_the_folder_are_refused(tmp_path):
    folder, outside = tmp_path / "folder", tmp_path / "folder-2"
    for each in (folder, outside):
        each.mkdir()
        (each / "file").write_text(each.name)
    (folder / "inner").symlink_to("file")
    (folder / "outer").symlink_to(outside / "file")
    (tmp_path / "alias").symlink_to(folder)
    for inside in (folder, tmp_path / "alias"):
        assert read_file(inside / "inner", 100, inside) == b"folder"
        with pytest.raises(RebodyError, match="outer is a link that leaves"):
            check_file(inside / "outer", 100, inside)
    with pytest.raises(FileNotFoundError):
        read_file(folder / "nowhere", 100, folder)
