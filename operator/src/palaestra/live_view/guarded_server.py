"""A viser server that is restricted to loopback, to its own page, and to a few kinds of messages.

By default, viser listens on all addresses, accepts connections from pages of any origin, and executes 15
kinds of messages from clients. One kind publishes the view through a tunnel to the internet; other kinds
upload files, or set any property of a control. A page of another site could send all these messages. This
module adds three restrictions:
- the server listens on 127.0.0.1;
- a request must name this host, which prevents DNS rebinding, and a websocket must come from the page of this
  server;
- each message of a client is dropped before a handler gets it, except the pose of the camera and the values
  of this page's own controls.

viser has no options for these restrictions, so this module replaces viser's classes while a server is
created. This process must not create another viser server meanwhile.
"""

from __future__ import annotations

import contextlib
import http
import io
import threading
from collections.abc import Callable
from typing import Any, Final
from urllib.parse import urlsplit

import msgspec
import viser
import viser.infra
import websockets.asyncio.server
from viser import _messages
from websockets import Headers
from websockets.http11 import Request, Response

LOOPBACK: Final = "127.0.0.1"
_OWN_NAMES: Final = frozenset((LOOPBACK, "localhost"))
_CAMERA: Final = _messages.ViewerCameraMessage.__name__
_CONTROL: Final = _messages.GuiUpdateMessage.__name__
_lock = threading.Lock()


class Dropped:
    """The type that replaces a refused message; no handler exists for this type."""


class Gate:
    """Decodes the messages of clients in place of viser's own decoder, and drops forbidden messages."""

    def __init__(self) -> None:
        self._controls: dict[str, Any] = {}

    def allow(self, control: Any) -> None:
        """Allow clients to set the value of a control."""
        self._controls[control._impl.uuid] = control  # viser has no public name for this id

    def deserialize(self, message: bytes) -> Any:
        """Return the decoded message of a client; `Dropped` if it is not allowed."""
        try:
            content = msgspec.msgpack.decode(message)
            accepted = content["type"] == _CAMERA or self._is_own_value(content)
            return _messages.Message.deserialize(message) if accepted else Dropped()
        except (msgspec.DecodeError, AttributeError, LookupError, TypeError, ValueError):
            return Dropped()

    def _is_own_value(self, content: Any) -> bool:
        own = content["type"] == _CONTROL and content["uuid"] in self._controls
        return own and content["updates"].keys() == {"value"}


def guarded(port: int, label: str) -> tuple[viser.ViserServer, Gate]:
    """Return a running server on loopback, and the gate that allows clients to use controls.

    Args:
        port: the port to listen on; if it is in use, the next free port is taken. 0: any free port.
        label: the title of the page.
    """
    gate = Gate()

    class GuardedServer(viser.infra.WebsockServer):
        """Listens on loopback, decodes messages with the gate, and serves only its own page."""

        def __init__(self, *, host: str, message_class: Any, **options: Any) -> None:
            del host, message_class
            reader: Any = gate
            super().__init__(host=LOOPBACK, message_class=reader, **options)

        def _background_worker(self, ready_sem: threading.Semaphore) -> None:
            websockets.asyncio.server.__dict__["serve"] = _serve_own_page
            super()._background_worker(ready_sem)

    with _lock:
        plain = viser.infra.WebsockServer
        viser.infra.__dict__["WebsockServer"] = GuardedServer
        try:
            # Suppress the table of addresses that viser prints.
            with contextlib.redirect_stdout(io.StringIO()):
                server = viser.ViserServer(host=LOOPBACK, port=port, label=label, verbose=False)
        finally:
            viser.infra.__dict__["WebsockServer"] = plain
    return server, gate


def stop(server: viser.ViserServer) -> None:
    """Stop a server."""
    with contextlib.redirect_stdout(io.StringIO()):  # suppress the line that viser prints about the stop
        server.stop()


def refusal(request: Request) -> Response | None:
    """Return the refusal of a request that does not come from this server's page; None if it is allowed."""
    host = request.headers.get("Host", "")
    if _name(f"//{host}") not in _OWN_NAMES:
        return _forbidden("this view accepts only requests to 127.0.0.1 or localhost")
    upgrade = request.headers.get("Upgrade", "").lower() == "websocket"
    if upgrade and request.headers.get("Origin") != f"http://{host}":
        return _forbidden("only the page of this view may connect")
    return None


def _name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


def _forbidden(fact: str) -> Response:
    body = f"{fact}\n".encode()
    headers = Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})
    return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", headers, body)


_plain_serve: Final = websockets.asyncio.server.serve
_Process = Callable[[Any, Request], Response | None]


def _serve_own_page(*args: Any, process_request: _Process, **options: Any) -> Any:
    """Serve like websockets' own function, but check each request before a response is sent."""

    def process(connection: Any, request: Request) -> Response | None:
        return refusal(request) or process_request(connection, request)

    return _plain_serve(*args, process_request=process, **options)
