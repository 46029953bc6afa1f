"""Folders that one process writes to: tried before the work, locked while it lasts, changed in one step."""

import errno
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import IO

from rebody.errors import RebodyError
from rebody.store.files import MB, reason, sync, written_whole

try:
    import fcntl
except ImportError:  # no such locks on this system: two runs are not told apart
    fcntl = None

LOCK = ".lock"
STAGE = ".new"
"""Subfolder in which files lie that are about to change together."""
_PROBE_SIZE = 4096


def take_folder(folder: Path) -> IO[bytes]:
    """Make a folder if need be, lock it until the returned file is closed, and try all that saving will do there.

    A killed process frees its lock. RebodyError if another one holds it, or the folder cannot be written to.
    """
    try:
        os.makedirs(os.path.realpath(folder), exist_ok=True)  # a link may lead to where nothing is yet
        lock = open(folder / LOCK, "ab")  # noqa: SIM115 (whoever calls closes it)
    except OSError as error:
        raise _not_writable(folder, error) from None
    try:
        _lock(lock, folder)
        try_folder(folder)
    except BaseException:
        lock.close()
        raise
    return lock


def try_folder(folder: Path) -> None:
    """RebodyError if files cannot be created, replaced and synced in a folder that is there."""
    probe = folder / f".probe-{os.getpid()}"  # others may try at the same time
    try:
        for _ in range(2):
            with written_whole(probe) as unfinished:
                unfinished.write_bytes(bytes(_PROBE_SIZE))
        sync(folder)
    except (OSError, RebodyError) as error:
        raise _not_writable(folder, error.__cause__ or error) from None
    finally:
        with suppress(OSError):
            probe.unlink(missing_ok=True)


def check_space(folder: Path, size: int) -> None:
    """RebodyError if the disk that a folder is on has less room than so many bytes."""
    free = shutil.disk_usage(folder).free
    if free < size:
        raise RebodyError(
            f"the folder {folder} needs {size / MB:.1f} MB, and its disk has {free / MB:.1f} MB left. "
            "Make room, or choose another folder."
        )


def replace_together(folder: Path, content: Mapping[str, bytes], commit: str) -> None:
    """Replace several files of a folder in one step: that in which `commit` is replaced.

    All are first written into a subfolder. `commit`, which says by hashes what belongs to it, is then moved to its
    place, and only then the others. So the old files are in their places until that step; from it on, each new one is
    in its place or still in the subfolder, from where `settle` brings it after a kill.
    """
    stage = folder / STAGE
    try:
        shutil.rmtree(stage, ignore_errors=True)
        stage.mkdir()
        for name, data in content.items():
            (stage / name).write_bytes(data)
            sync(stage / name)
        sync(stage)
    except BaseException:
        shutil.rmtree(stage, ignore_errors=True)
        raise
    os.replace(stage / commit, folder / commit)
    sync(folder)
    settle(folder, [name for name in content if name != commit])


def settle(folder: Path, names: Iterable[str]) -> None:
    """Bring these files from the subfolder to their places, as far as they are there, and remove it."""
    stage = folder / STAGE
    for name in names:
        if (stage / name).exists():
            os.replace(stage / name, folder / name)
    sync(folder)
    shutil.rmtree(stage, ignore_errors=True)


def _lock(file: IO[bytes], folder: Path) -> None:
    if fcntl is None:
        return
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.EWOULDBLOCK, errno.EACCES):
            raise RebodyError(
                f"another run writes to {folder}. Wait until it has ended, or choose another folder."
            ) from None
        # some network drives have no locks: better a run without one than none


def _not_writable(folder: Path, error: BaseException) -> RebodyError:
    return RebodyError(f"the folder {folder} cannot be written to: {reason(error)}. Choose another, or mend this one.")
