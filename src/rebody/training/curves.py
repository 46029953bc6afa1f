"""Curves for TensorBoard."""

import socket
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tensorboardX.proto.event_pb2 import Event, SessionLog  # pyright: ignore[reportAttributeAccessIssue] (generated)
from tensorboardX.record_writer import RecordWriter
from tensorboardX.summary import scalar

from rebody.errors import RebodyError
from rebody.store.files import reason


class Curves:
    """An events file. RebodyError where it cannot be written, such as on a full disk.

    It is written by the thread that trains: tensorboardX's own thread dies of a full disk unheard, and whoever still
    has something to tell it then waits for ever.
    """

    def __init__(self, folder: Path, first_step: int):
        """What other files of the folder tell of `first_step` and later is void: a killed run tells of it again."""
        self._folder = folder
        with self._heard():
            folder.mkdir(parents=True, exist_ok=True)
            self._writer = RecordWriter(str(folder / f"events.out.tfevents.{int(time.time())}.{socket.gethostname()}"))
        self._write(Event(file_version="brain.Event:2"))
        self._write(Event(step=first_step, session_log=SessionLog(status=SessionLog.START)))

    def add(self, values: Mapping[str, float], step: int) -> None:
        """A point of each curve."""
        for name, value in values.items():
            self._write(Event(step=step, summary=scalar(name, value)))

    def flush(self) -> None:
        """Let whoever looks at the file see all of it."""
        with self._heard():
            self._writer.flush()

    def close(self) -> None:
        """Flush, and write no more; the file is closed even where that fails."""
        with self._heard():
            self._writer.close()

    def _write(self, event: Event) -> None:
        event.wall_time = time.time()
        with self._heard():
            self._writer.write(event.SerializeToString())

    @contextmanager
    def _heard(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise RebodyError(
                f"curves cannot be written to {self._folder}: {reason(error)}. Checkpoints are whole: mend this, then "
                "go on with --resume."
            ) from error
