"""A browser without a browser: what viser's page sends and hears, over a real WebSocket."""

import socket
from typing import Any

import msgspec
import pytest

PATIENCE_S = 60.0


class Browser:
    """Speaks as viser's page does."""

    def __init__(self, port: int, host: str = "127.0.0.1:{port}", origin: str | None = "http://127.0.0.1:{port}"):
        import viser
        from websockets.sync.client import connect

        self._socket = connect(
            f"ws://{host.format(port=port)}",
            sock=socket.create_connection(("127.0.0.1", port)),
            origin=origin and origin.format(port=port),
            subprotocols=[f"viser-v{viser.__version__}"],
            compression=None,
            max_size=None,
            max_queue=None,  # it closes without having read all
        )

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._socket.close()

    def hear(self) -> list[dict[str, Any]]:
        """The server's next messages."""
        import zstandard

        frame = self._socket.recv(timeout=PATIENCE_S)
        packed = frame[16 : 16 + int.from_bytes(frame[8:16], "little")]
        return msgspec.msgpack.decode(zstandard.decompress(packed))["messages"]

    def hear_all(self) -> None:
        """Until the connection ends, with what it ended with."""
        while True:
            self.hear()

    def widgets(self) -> dict[str, str]:
        """uuids of what can be changed, by label without unit."""
        found: dict[str, str] = {}
        while "Agent" not in found:  # the last one
            for message in self.hear():
                if message["type"].startswith("Gui") and "label" in message.get("props", {}):
                    found[message["props"]["label"].split(" [")[0]] = message["uuid"]
        return found

    def look(self) -> None:
        """Only then is it a browser that looks on."""
        self.send(self.view())

    @staticmethod
    def view(x: Any = 0.0) -> dict[str, Any]:
        """What it says of its camera, which is at x."""
        places = {"position": [x, -6.5, 1.8], "look_at": [0, 0, 0.9], "up_direction": [0, 0, 1.0]}
        size = {"image_height": 9, "image_width": 9}
        return {"type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], **places, "fov": 1, "near": 0.1, "far": 9, **size}

    def change(self, uuid: str, value: Any) -> None:
        self.send({"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value}})

    def send(self, message: Any) -> None:
        raw = isinstance(message, bytes | str)
        self._socket.send(message if raw else msgspec.msgpack.encode(message))


@pytest.fixture
def visit():
    """Browser(port), or one that asks for another host, on behalf of another site."""
    pytest.importorskip("viser")
    return Browser
