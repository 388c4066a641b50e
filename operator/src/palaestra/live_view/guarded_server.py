"""viser's server, on loopback, for pages of its own, with few messages of a browser.

As it comes, viser listens on all addresses, accepts pages of any origin, and obeys 15 kinds of messages of
its clients. One of them publishes the view through a tunnel to the internet; others upload files, or set any
property of a control. A page on another site could send all of them. Here
- the server listens on 127.0.0.1;
- a request must name this host, so that no foreign name can be bound to the address, and a websocket must
  come from the page of this server;
- each message of a client is dropped before any handler sees it, unless it is the pose of the camera, or a
  value of one of our own controls.

viser has no options for these, so its classes are replaced while a server is made; this process has no other
server of that kind.
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
    """What becomes of a message that is not accepted; it has no handler."""


class Gate:
    """Reads the messages of clients in place of viser's own reader, and drops those that are not accepted."""

    def __init__(self) -> None:
        self._controls: dict[str, Any] = {}

    def allow(self, control: Any) -> None:
        """Let clients set the value of a control."""
        self._controls[control._impl.uuid] = control  # viser has no public name for it

    def deserialize(self, message: bytes) -> Any:
        """Return a message of a client, or `Dropped`."""
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
    """Return a running server on loopback, and the gate that decides which controls clients may use.

    Args:
        port: to listen on; the next free one is taken if it is in use, and any for 0.
        label: the title of the page.
    """
    gate = Gate()

    class GuardedServer(viser.infra.WebsockServer):
        """Listens on loopback, reads messages through the gate, and serves its own page only."""

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
            with contextlib.redirect_stdout(io.StringIO()):  # viser prints a table of addresses
                server = viser.ViserServer(host=LOOPBACK, port=port, label=label, verbose=False)
        finally:
            viser.infra.__dict__["WebsockServer"] = plain
    return server, gate


def stop(server: viser.ViserServer) -> None:
    """End a server."""
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints that it has stopped
        server.stop()


def refusal(request: Request) -> Response | None:
    """Return the response to a request that is not of this server's page; None for others."""
    host = request.headers.get("Host", "")
    if _name(f"//{host}") not in _OWN_NAMES:
        return _forbidden("this view answers only as 127.0.0.1 or localhost")
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
    """Serve as websockets does, with a look at each request before anything is sent."""

    def process(connection: Any, request: Request) -> Response | None:
        return refusal(request) or process_request(connection, request)

    return _plain_serve(*args, process_request=process, **options)
