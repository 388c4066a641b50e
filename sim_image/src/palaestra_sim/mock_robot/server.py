"""An HTTP server whose connections stay open, as those of a Robotino do.

A table maps methods and paths to functions. The server ignores the query of a path, such as `?sid=name`. The
number of connections, the length of a request and every wait are limited. If all connections are in use, a
new connection replaces an idle connection (`connection_limits`).
"""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, Final, cast

from palaestra_protocol.connection_limits import ConnectionSlots
from palaestra_protocol.http import Address, error_response
from palaestra_protocol.tcp_server import TcpServer

MOST_BODY_BYTES: Final = 4096
IDLE_S: Final = 30.0
_OK: Final = b"HTTP/1.1 200 OK\r\nContent-Type: %s\r\nContent-Length: %d\r\n\r\n"

Route = Callable[[bytes], Any]
"""Takes the body of a request.

Returns:
    The content of the JSON response, the bytes of a JPEG picture, or None for an empty response.
"""
Routes = Mapping[tuple[str, str], Route]
"""The route for each method and path."""


class BadRequestError(ValueError):
    """The body of a request is wrong; the message has the field, the fact and the remedy."""


class RestServer(TcpServer):
    """A server on one port; see `TcpServer`.

    Args:
        address: the address on which the server listens; port 0 means that the system chooses a free port.
        routes: the route for each method and path.
        wait_s: returns the delay of the next response for a path, in seconds of real time.

    Raises:
        OSError: the address is in use, or does not belong to this machine.
    """

    poll_s = 0.05

    ends_connections = True

    def __init__(self, address: Address, routes: Routes, wait_s: Callable[[str], float]) -> None:
        self.address_family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self.routes = routes
        self.wait_s = wait_s
        self.closing = threading.Event()
        super().__init__((address.host, address.port), _Handler, name="REST", slots=ConnectionSlots())

    @property
    def address(self) -> Address:
        """The address on which the server listens, with the port that the system chose."""
        return Address(*self.socket.getsockname()[:2])

    def close(self) -> None:
        """Stop accepting connections, close the open connections, and free the address."""
        self.closing.set()
        super().close()


class _Handler(BaseHTTPRequestHandler):
    """Handles the requests of one connection."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    timeout = IDLE_S

    def do_GET(self) -> None:
        self._answer(b"")

    def do_PUT(self) -> None:
        self._answer_with_body()

    def do_POST(self) -> None:
        self._answer_with_body()

    def log_message(self, *_: Any, **__: Any) -> None:
        """Log nothing: programs send a hundred requests each second."""

    @property
    def _server(self) -> RestServer:
        return cast("RestServer", self.server)

    def _answer_with_body(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdecimal():
            self._refuse(
                HTTPStatus.LENGTH_REQUIRED, "Content-Length: is missing; give the length of the body"
            )
        elif len(length) > len(str(MOST_BODY_BYTES)) or int(length) > MOST_BODY_BYTES:
            fact = f"body: has more than {MOST_BODY_BYTES} bytes; send a shorter body"
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, fact)
        elif len(body := self.rfile.read(int(length))) < int(length):
            self.close_connection = True
        else:
            self._answer(body)

    def _answer(self, body: bytes) -> None:
        """Call the route, and send its response when the response is due."""
        server, path = self._server, self.path.partition("?")[0]
        server.slots.answering(self.connection, now=True)
        try:
            response = self._response(path, body)
            if (wait_s := server.wait_s(path)) > 0.0:
                server.closing.wait(wait_s)
        finally:
            server.slots.answering(self.connection, now=False)
        self.wfile.write(response)

    def _response(self, path: str, body: bytes) -> bytes:
        routes = self._server.routes
        route = routes.get((self.command, path))
        if route is None:
            known = any(path == other for _, other in routes)
            status = HTTPStatus.METHOD_NOT_ALLOWED if known else HTTPStatus.NOT_FOUND
            return _error(
                status, f"{path}: does not accept {self.command}" if known else f"{path}: is unknown"
            )
        try:
            content = route(body)
        except BadRequestError as error:
            return _error(HTTPStatus.BAD_REQUEST, str(error))
        if isinstance(content, bytes):
            return _OK % (b"image/jpeg", len(content)) + content
        data = b"" if content is None else json.dumps(content).encode()
        return _OK % (b"application/json", len(data)) + data

    def _refuse(self, status: HTTPStatus, fact: str) -> None:
        """Refuse a request whose body the server does not read; the connection cannot be used again."""
        self.close_connection = True
        self.wfile.write(_error(status, fact, "Connection: close\r\n"))


def _error(status: HTTPStatus, fact: str, header: str = "") -> bytes:
    body = error_response(status, fact).body
    head = f"HTTP/1.1 {status.value} {status.phrase}\r\n{header}Content-Type: application/json\r\n"
    return f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body
