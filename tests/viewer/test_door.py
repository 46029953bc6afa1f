"""Which requests the live page answers, and which messages it takes."""

import http.client
import math
import threading
from contextlib import contextmanager

import msgspec
import pytest

from rebody.errors import RebodyError

pytest.importorskip("viser")
pytest.importorskip("mjviser")
from websockets.exceptions import ConnectionClosed, InvalidStatus

from rebody.viewer import server as server_module
from rebody.viewer.door import LARGEST_MESSAGE, may_come_in
from rebody.viewer.server import serving


@pytest.mark.parametrize(
    ("host", "origin", "comes_in"),
    [
        ("127.0.0.1:{port}", "http://127.0.0.1:{port}", True),
        ("localhost:{port}", "http://localhost:{port}", True),
        ("[::1]:{port}", "http://[::1]:{port}", True),
        ("127.0.0.1:{port}", None, True),  # no browser
        ("127.0.0.1:{port}", "http://evil.example", False),
        ("127.0.0.1:{port}", "http://evil.example:{port}", False),
        ("127.0.0.1:{port}", "https://127.0.0.1:{port}", False),
        ("127.0.0.1:{port}", "http://127.0.0.1:1", False),
        ("127.0.0.1:{port}", "null", False),  # a file, a sandboxed frame
        ("evil.example:{port}", "http://evil.example:{port}", False),  # DNS rebinding
        ("evil.example:{port}", None, False),
        ("127.0.0.1.evil.example:{port}", None, False),
        ("127.0.0.1:1", None, False),
        ("127.0.0.1", None, False),
    ],
)
def test_only_this_machine_s_own_pages_come_in(visit, host, origin, comes_in):
    with serving(0) as server:
        port = server.get_port()
        headers = {"Host": host.format(port=port)} | ({} if origin is None else {"Origin": origin.format(port=port)})
        assert fetched(port, headers) == (200 if comes_in else 403)
        if comes_in:
            with visit(port, host, origin) as browser:
                assert browser.hear()
        else:
            with pytest.raises(InvalidStatus, match="403"):
                visit(port, host, origin)


def fetched(port: int, headers: dict[str, str]) -> int:
    """Status of the page itself."""
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", "/", headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


def test_without_a_guard_there_is_no_page(monkeypatch):
    @contextmanager
    def guarded():
        yield threading.Event()

    monkeypatch.setattr(server_module, "guarded", guarded)
    with pytest.raises(RebodyError, match="cannot be guarded"), serving(0):
        pass


def test_who_sends_too_much_at_once_is_cut_off(visit):
    with serving(0) as server, visit(server.get_port()) as browser:
        browser.send(bytes(LARGEST_MESSAGE + 1))
        with pytest.raises(ConnectionClosed, match="1009"):
            browser.hear_all()


@pytest.mark.parametrize(
    ("message", "comes_in"),
    [
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": 1}}, True),
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": "cheetah"}}, True),
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": math.nan}}, False),
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": [1.0]}}, False),
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"value": None}}, False),
        ({"type": "GuiUpdateMessage", "uuid": "a", "updates": {"removed": True}}, False),
        ({"type": "GuiUpdateMessage", "uuid": ["a"], "updates": {"value": 1}}, False),
        ({"type": "ShareUrlRequest"}, False),  # a public tunnel to the page
        ({"type": ["GuiUpdateMessage"]}, False),
        ([], False),
    ],
)
def test_of_a_widget_only_its_value_is_changed(message, comes_in):
    assert may_come_in(msgspec.msgpack.encode(message)) == comes_in


def test_a_view_comes_in_unless_it_is_from_nowhere(visit):
    assert may_come_in(msgspec.msgpack.encode(visit.view(1.0)))
    assert not may_come_in(msgspec.msgpack.encode(visit.view(math.nan)))


@pytest.mark.parametrize("message", [b"", b"\xc1", b"\x82\xa1a" + b"\x91" * 60_000, b"\x82\xa4type\xa1\xff", "text"])
def test_what_is_no_message_does_not_come_in(message):
    assert not may_come_in(message)
