"""A file is written whole or not at all."""

import pytest

from rebody.store.files import written_whole


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
