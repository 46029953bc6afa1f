"""Files that commands write."""

from collections.abc import Iterable
from pathlib import Path

from rebody.errors import RebodyError
from rebody.store.artifact import HASHED, MANIFEST
from rebody.store.files import output_file
from rebody.store.folders import try_folder

PICTURES = (".png", ".pdf", ".svg")
"""Suffixes of figures."""


def check_output(
    path: Path | None, option: str, suffixes: tuple[str, ...] = (), inputs: Iterable[str | Path] = ()
) -> None:
    """RebodyError, before any work is done, for a path that no file (of these kinds, if any) can be written to.

    Nor is what a command reads written over: `inputs` that are files, and the files of artifacts.
    """
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise RebodyError(f"{option} {path}: the name must end with {' or '.join(suffixes)}.")
    if blocking := [parent for parent in path.parents if parent.exists() and not parent.is_dir()]:
        raise RebodyError(f"{option} {path}: {blocking[0]} is a file, not a folder.")
    try:
        target = output_file(path)
        try_folder(next(parent for parent in target.parents if parent.exists()))
    except RebodyError as error:
        raise RebodyError(f"{option} {path}: {error}") from None
    if any(path.samefile(each) for each in map(Path, inputs) if path.exists() and each.exists()):
        raise RebodyError(f"{option} {path} would write over what is read. Choose another file.")
    if target.name in (*HASHED, MANIFEST) and (target.parent / MANIFEST).exists():
        raise RebodyError(f"{option} {path} is a part of the artifact {target.parent}. Choose another file.")
