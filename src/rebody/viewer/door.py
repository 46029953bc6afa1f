"""The door of the live page: which requests come in, and which messages of theirs.

Any website that is open in a browser can send requests to this machine. A socket is not bound by the same-origin
policy, and by DNS rebinding a site makes its own name resolve to 127.0.0.1. Both show in the headers: a browser always
says in `Origin` which site asks, and in `Host` which name it asked for.
"""

import http
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Literal

import msgspec
import websockets.asyncio.server
from websockets import Headers
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response
from websockets.typing import Data

from rebody.inputs import LARGEST

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")
"""Names by which only this machine can be meant."""
LARGEST_MESSAGE = 1 << 16
"""A connection that sends more bytes at once is closed. viser would take 50 MiB."""

_one_at_a_time = threading.Lock()


@contextmanager
def guarded() -> Iterator[threading.Event]:
    """A viser server that starts inside gets this door; the event is set if it did.

    viser passes no options on to websockets. So the function that it calls there, `serve`, is replaced while it starts.
    """
    original, is_guarded = websockets.asyncio.server.serve, threading.Event()

    def serve(*arguments: Any, process_request: Any = None, **options: Any) -> Any:
        is_guarded.set()

        def checked(connection: ServerConnection, request: Request) -> Any:
            refused = refusal(connection, request.headers)
            return refused or (process_request and process_request(connection, request))

        options |= {"process_request": checked, "create_connection": Connection, "max_size": LARGEST_MESSAGE}
        return original(*arguments, **options)

    with _one_at_a_time:
        websockets.asyncio.server.serve = serve
        try:
            yield is_guarded
        finally:
            websockets.asyncio.server.serve = original


def refusal(connection: ServerConnection, headers: Headers) -> Response | None:
    """An answer to who asked for another host than this page, or for another site; None for all others."""
    port = connection.local_address[1]
    names = {f"{host}:{port}" for host in LOOPBACK}
    if port == 80:
        names |= {*LOOPBACK}  # browsers leave that port out
    hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
    if len(hosts) == 1 and hosts[0].lower() in names and {*origins} <= {f"http://{name}" for name in names}:
        return None
    return connection.respond(http.HTTPStatus.FORBIDDEN, f"This page is for http://{LOOPBACK[0]}:{port} alone.\n")


class Connection(ServerConnection):
    """Hands on only what a widget or the view of this page can send; all else is dropped."""

    async def recv(self, decode: bool | None = None) -> Data:
        """The next message that may come in."""
        while True:
            message = await super().recv(decode)
            if may_come_in(message):
                return message


def may_come_in(message: Data) -> bool:
    """Whether these bytes are a widget's new value or a view, and nothing else.

    viser's own rules let a browser set any attribute of a widget, upload files, and open a public tunnel to the page.
    """
    try:
        _decoder.decode(message)  # pyright: ignore[reportArgumentType] # text is refused like other nonsense
    except Exception:  # decoding raises errors of several kinds
        return False
    return True


_Number = Annotated[float, msgspec.Meta(ge=-LARGEST, le=LARGEST)]  # NaN is neither


class _NewValue(msgspec.Struct, tag_field="type", tag="GuiUpdateMessage", forbid_unknown_fields=True):
    uuid: str
    updates: dict[Literal["value"], _Number | str | bool]


class _View(msgspec.Struct, tag_field="type", tag="ViewerCameraMessage", forbid_unknown_fields=True):
    wxyz: tuple[_Number, _Number, _Number, _Number]
    position: tuple[_Number, _Number, _Number]
    look_at: tuple[_Number, _Number, _Number]
    up_direction: tuple[_Number, _Number, _Number]
    fov: _Number
    near: _Number
    far: _Number
    image_height: int
    image_width: int


_decoder = msgspec.msgpack.Decoder(_NewValue | _View)
