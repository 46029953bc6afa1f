"""Files that commands write."""

from pathlib import Path

from rebody.errors import RebodyError

PICTURES = (".png", ".pdf", ".svg")
"""Suffixes of figures."""


def check_output(path: Path | None, option: str, suffixes: tuple[str, ...] = ()) -> None:
    """RebodyError, before any work is done, for a path that no file (of these kinds, if any) can be written to."""
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise RebodyError(f"{option} {path}: the name must end with {' or '.join(suffixes)}.")
    if path.is_dir():
        raise RebodyError(f"{option} {path} is a folder; name a file.")
    if blocking := [parent for parent in path.parents if parent.exists() and not parent.is_dir()]:
        raise RebodyError(f"{option} {path}: {blocking[0]} is a file, not a folder.")
