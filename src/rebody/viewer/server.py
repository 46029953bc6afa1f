"""The server behind the page."""

import socket
from collections.abc import Iterator
from contextlib import contextmanager

import viser

from rebody.errors import RebodyError
from rebody.viewer.door import guarded

HOST = "127.0.0.1"
"""This machine alone: who sees the page can move the robot."""


@contextmanager
def serving(port: int) -> Iterator[viser.ViserServer]:
    """A server at that port (0: any free one), stopped at the end; RebodyError where it is taken or has no guard."""
    _check_free(port)
    with guarded() as is_guarded:
        server = viser.ViserServer(host=HOST, port=port, label="rebody", verbose=False)
    try:
        if not is_guarded.is_set():
            raise RebodyError(f"viser {viser.__version__} starts in a way that cannot be guarded; install viser 1.1.1.")
        yield server
    finally:
        server.stop()


def _check_free(port: int) -> None:
    """The server would silently take another one, and a user would look at the page of somebody else."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the server does; Linux: not one that listens
        try:
            probe.bind((HOST, port))
        except (OSError, OverflowError) as error:
            raise RebodyError(
                f"cannot serve at port {port} ({error}). Is another page open there? End it, or choose another port: "
                "rebody view --port 8081."
            ) from error
