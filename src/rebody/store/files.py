"""Files read and written whole: regular ones only, and none that a failure leaves half written."""

import errno
import os
import shutil
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from safetensors import SafetensorError

from rebody.errors import RebodyError

MB = 10**6
TEXT, DATA, WEIGHTS = 16 * MB, 500 * MB, 1000 * MB
"""Largest files that are read [bytes]: task files, settings and cards; logs, results and videos; trained parts."""

_KINDS = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def read_file(path: Path, limit: int, inside: Path | None = None) -> bytes:
    """The content of a regular file of at most `limit` bytes, and not outside the folder `inside`, be it by a link.

    Raises:
        RebodyError: it is something else.
        OSError: it is not there, or may not be read.
    """
    check_file(path, limit, inside)
    with open(path, "rb", opener=_open_at_once) as file:
        data = file.read(limit + 1)
    if len(data) > limit:  # it grew, or is one of those that have no size
        raise _too_large(path, limit)
    return data


def check_file(path: Path, limit: int, inside: Path | None = None) -> None:
    """What `read_file` asks of a file before it opens it: opening a pipe may wait for ever, a device do anything."""
    if inside is not None and not Path(os.path.realpath(path)).is_relative_to(os.path.realpath(inside)):
        raise RebodyError(f"{path} is a link that leaves {inside}. Put the file itself there.")
    found = os.stat(path)
    if not stat.S_ISREG(found.st_mode):
        raise RebodyError(f"{path} is {_kind(found.st_mode)}; a regular file is needed here.")
    if found.st_size > limit:
        raise _too_large(path, limit)


def output_file(path: Path) -> Path:
    """Where writing to `path` goes: links are followed, to a file that need not be there yet.

    RebodyError if there is something else than a regular file.
    """
    with suppress(FileNotFoundError):
        mode = os.stat(path).st_mode
        if not stat.S_ISREG(mode):
            raise RebodyError(f"{path} is {_kind(mode)}; name a regular file.")
    return Path(os.path.realpath(path))


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """A file to write to, which then becomes `path`; where writing fails, `path` is as it was.

    RebodyError if it cannot be written, such as on a full disk.
    """
    target = output_file(path)
    unfinished = target.with_name(f".{target.stem}.new{path.suffix}")  # some writers go by the suffix
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        unfinished.unlink(missing_ok=True)  # never written through, should it be a link
        yield unfinished
        sync(unfinished)
        _replace(target, unfinished)
    except (OSError, SafetensorError) as error:
        raise RebodyError(f"{path} cannot be written: {reason(error)}.") from error
    finally:
        with suppress(OSError):
            unfinished.unlink(missing_ok=True)


def _replace(target: Path, new: Path) -> None:
    try:
        os.replace(new, target)
    except OSError as error:
        if error.errno != errno.EBUSY:
            raise
        shutil.copyfile(new, target)  # a file that is a mount point of its own, as in a container


def sync(path: Path) -> None:
    """Wait until a file's content, or a folder's list of entries, is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # a file system that cannot: all is done that can be
            raise
    finally:
        os.close(descriptor)


def reason(error: BaseException) -> str:
    """What the system says, in one line; some libraries wrap it into errors of their own."""
    text = (isinstance(error, OSError) and error.strerror) or str(error)
    return text.partition("\n")[0].rstrip(".")


def _kind(mode: int) -> str:
    return next((name for is_kind, name in _KINDS if is_kind(mode)), "no file")


def _open_at_once(path: str, flags: int) -> int:
    """Even where a pipe took the file's place since it was looked at."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _too_large(path: Path, limit: int) -> RebodyError:
    return RebodyError(f"{path} is larger than {limit / MB:g} MB: too large for what it should be.")
