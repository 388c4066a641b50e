"""A browser may send two messages to a live view: the pose of its camera, and the use of our own controls."""

import http.client
from typing import get_type_hints

import msgspec
import pytest
import viser
from viser import _messages
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from palaestra.live_view.guarded_server import Dropped, guarded, stop
from tests.waiting import eventually

PLAIN = {str: "x", int: 1, float: 1.0, bool: True, bytes: b"x"}
CLASSES = {one.__name__: one for one in _messages.Message.get_subclasses()}


def sent(kind, **given):
    """Return the bytes of a message of a class, with plausible values."""
    hints = get_type_hints(kind)
    fields = {name: PLAIN.get(hint, ()) for name, hint in hints.items() if name in kind.__dataclass_fields__}
    return msgspec.msgpack.encode(fields | given | {"type": kind.__name__})


def camera():
    """Return the message with which a browser reports its camera."""
    return sent(
        _messages.ViewerCameraMessage,
        wxyz=(1.0, 0.0, 0.0, 0.0),
        position=(0.0, 0.0, 1.0),
        look_at=(0.0, 0.0, 0.0),
        up_direction=(0.0, 0.0, 1.0),
    )


def everything():
    """Yield the name of each message class, with a message of this class."""
    for name, kind in CLASSES.items():
        yield name, camera() if kind is _messages.ViewerCameraMessage else sent(kind)


@pytest.fixture(scope="module")
def view():
    """Yield a running view and its gate; the view has a foreign text field and one of our buttons."""
    server, gate = guarded(0, "test")
    server.foreign = server.gui.add_text("path", "unchanged")
    server.own = server.gui.add_button("kill")
    server.clicks = []
    server.own.on_click(lambda _: server.clicks.append(1))
    gate.allow(server.own)
    yield server, gate
    stop(server)


@pytest.fixture
def browser(view):
    """Return a function that connects as the page of the view does, or with another origin or host."""
    port = view[0].get_port()

    def connected(origin=None, **headers):
        address = f"127.0.0.1:{port}"
        return connect(
            f"ws://{address}",
            origin=origin or f"http://{address}",
            subprotocols=[f"viser-v{viser.__version__}"],
            additional_headers=headers,
        )

    return connected


def test_no_message_but_two_reaches_a_handler(view):
    """A later version of Viser may add messages, so the gate lists the messages that it accepts."""
    _, gate = view

    passed = {name for name, data in everything() if not isinstance(gate.deserialize(data), Dropped)}

    assert passed == {"ViewerCameraMessage"}, "the value of a control needs one of our controls"
    assert "ShareUrlRequest" in CLASSES, "the test knows viser's names"


@pytest.mark.parametrize("rubbish", [b"", b"\xc1", b"\x00", msgspec.msgpack.encode({"type": ["x"]})])
def test_rubbish_is_dropped(view, rubbish):
    """An exception would end the connection and print a traceback on the user's terminal."""
    assert isinstance(view[1].deserialize(rubbish), Dropped)


def test_every_message_of_viser_is_sent_and_has_no_effect(view, browser, monkeypatch):
    """A foreign page that could open a tunnel or upload a file could control the user's machine."""
    server, _ = view
    shared = []
    monkeypatch.setattr(server, "request_share_url", lambda: shared.append(1))
    monkeypatch.setattr(server, "disconnect_share_url", lambda: shared.append(1))
    foreign, own = server.foreign._impl.uuid, server.own._impl.uuid

    with browser() as page:
        for _, data in everything():
            page.send(data)
        page.send(sent(_messages.GuiUpdateMessage, uuid=foreign, updates={"value": "/etc/passwd"}))
        page.send(sent(_messages.GuiUpdateMessage, uuid=own, updates={"label": "harmless"}))
        page.send(sent(_messages.FileTransferStartUpload, source_component_uuid=foreign))
        page.send(camera())
        eventually(server.get_clients)
        page.send(sent(_messages.GuiUpdateMessage, uuid=own, updates={"value": True}))
        eventually(lambda: server.clicks)

    assert shared == []
    assert server.foreign.value == "unchanged"
    assert server.own.label == "kill"
    assert server.gui._current_file_upload_states == {}


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://127.0.0.1", "http://localhost"]
)
def test_a_page_of_another_origin_cannot_connect(browser, origin):
    """Any web page in the user's browser can send requests to the loopback address."""
    with pytest.raises(InvalidStatus) as refused:
        browser(origin=origin)

    assert refused.value.response.status_code == 403


def test_a_foreign_name_for_this_address_gets_nothing(view):
    """A web site can point its own host name to 127.0.0.1 and then read the page as its own."""
    connection = http.client.HTTPConnection("127.0.0.1", view[0].get_port(), timeout=10.0)
    connection.request("GET", "/", headers={"Host": "evil.example"})
    answer = connection.getresponse()

    assert answer.status == 403
    assert b"only" in answer.read()
    connection.close()


def test_the_own_page_is_served_and_only_on_loopback(view):
    """By default, Viser listens on all addresses of the machine."""
    server, _ = view
    assert server.get_host() == "127.0.0.1"
    connection = http.client.HTTPConnection("127.0.0.1", server.get_port(), timeout=10.0)
    connection.request("GET", "/")

    assert connection.getresponse().status == 200
    connection.close()
