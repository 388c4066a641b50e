"""The HTTP server of operator, trainer and sidecar.

A table maps methods and paths to functions (`Routes`). Each connection carries one request. If a request is
not complete at its deadline, or has more than MOST_REQUEST_BYTES, the server closes the connection without a
response. The number of connections is limited, as `connection_limits` describes.

Errors are JSON: {"error": "<field>: <fact>"}. The status is 404 for an unknown path, 405 for a wrong method,
411 for a POST without Content-Length and 413 for a body that is too long. Requests are not logged, because
probes and scrapes come every few seconds.
"""

import io
import ipaddress
import json
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, NamedTuple, Self, cast

from palaestra_protocol.connection_limits import MOST_CONNECTIONS, ConnectionSlots
from palaestra_protocol.numbers import MOST_PORT
from palaestra_protocol.tcp_server import TcpServer

# Larger than http.server's limit of 64 KiB for a path, so that the server can respond with 414.
MOST_REQUEST_BYTES = 2**17
MOST_BODY_BYTES = 4096
DEADLINE_S = 5.0


class Address(NamedTuple):
    """The address on which a server listens; port 0 means that the system chooses a free port."""

    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Return the address in a text such as `127.0.0.1:7100` or `[::1]:7100`.

        Raises:
            ValueError: `text` is not an IP address with a port from 0 to 65535.
        """
        host, _, port = text.rpartition(":")
        bare = host.removeprefix("[").removesuffix("]")
        try:
            ipaddress.ip_address(bare)
            if 0 <= int(port) <= MOST_PORT:
                return cls(bare, int(port))
        except ValueError:
            pass
        raise ValueError(f"{text!r} is not an address such as 127.0.0.1:7100")

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """A response: its status, its body, and the content type of the body."""

    status: HTTPStatus
    body: bytes
    content_type: str


Route = Callable[[bytes], Response]  # takes the body of a request
Routes = Mapping[tuple[str, str], Route]  # keys: the method, GET or POST, and the path


def json_response(status: HTTPStatus, content: Mapping[str, Any]) -> Response:
    """Return a response with JSON content."""
    return Response(status=status, body=json.dumps(content).encode() + b"\n", content_type="application/json")


def error_response(status: HTTPStatus, fact: str) -> Response:
    """Return an error response in the format that the server itself uses."""
    return json_response(status, {"error": fact})


def probe_response(trouble: str | None = None) -> Response:
    """Return the response to a probe: "ok", or 503 with the reason."""
    return Response(
        status=HTTPStatus.OK if trouble is None else HTTPStatus.SERVICE_UNAVAILABLE,
        body=f"{'ok' if trouble is None else trouble}\n".encode(),
        content_type="text/plain; charset=utf-8",
    )


class Server(TcpServer):
    """A server on one port; see `TcpServer`.

    Args:
        address: the address on which the server listens. `0.0.0.0` and `::` both mean every address of the
            machine, IPv4 and IPv6, because the cluster decides whether a pod has an IPv4 or IPv6 address.
        routes: the function for each method and path.
        name: the name of the program, for the header `Server` and the thread.
        deadline_s: time limit for reading a request; the same limit applies to writing the response.

    Raises:
        OSError: the address is in use, or does not belong to this machine.
    """

    request_queue_size = MOST_CONNECTIONS

    def __init__(
        self, address: Address, routes: Routes, *, name: str, deadline_s: float = DEADLINE_S
    ) -> None:
        self._every = _is_every(address.host)
        host = _every_host() if self._every else address.host
        self.address_family = socket.AF_INET6 if ":" in host else socket.AF_INET
        self.routes = routes
        self.deadline_s = deadline_s
        super().__init__((host, address.port), _Handler, name=name, slots=ConnectionSlots())

    @property
    def address(self) -> Address:
        """The address on which the server listens, with the port that the system chose."""
        return Address(*self.socket.getsockname()[:2])

    def server_bind(self) -> None:
        """Bind the socket.

        A server for all addresses accepts IPv4 connections also on an IPv6 socket, even if the system's
        default forbids that.
        """
        if self._every and self.address_family == socket.AF_INET6:
            self.socket.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_V6ONLY, 0)
        super().server_bind()


def _is_every(host: str) -> bool:
    """Return whether `host` is `0.0.0.0` or `::`, which stand for every address of the machine."""
    try:
        return ipaddress.ip_address(host).is_unspecified
    except ValueError:
        return False


def _every_host() -> str:
    """Return the host that stands for every address: `::`, or `0.0.0.0` if the kernel has no IPv6."""
    return str(ipaddress.IPv6Address(0) if socket.has_dualstack_ipv6() else ipaddress.IPv4Address(0))


class _Handler(BaseHTTPRequestHandler):
    """Handles one request: calls the function of its route, and sends the response."""

    def setup(self) -> None:
        super().setup()
        self.rfile.close()
        self.rfile = io.BufferedReader(_Reader(self.connection, self._server.deadline_s))

    def version_string(self) -> str:
        return self._server.name

    def do_GET(self) -> None:
        self._answer(b"")

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdecimal():
            self._send(error_response(HTTPStatus.LENGTH_REQUIRED, "Content-Length: is missing"))
        elif len(length) > len(str(MOST_BODY_BYTES)) or int(length) > MOST_BODY_BYTES:
            fact = f"body: more than {MOST_BODY_BYTES} bytes"
            self._send(error_response(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, fact))
        else:
            self._answer(self.rfile.read(int(length)))

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - http.server's signature
        """Log nothing."""

    @property
    def _server(self) -> Server:
        return cast("Server", self.server)

    def _answer(self, body: bytes) -> None:
        routes, path = self._server.routes, self.path.partition("?")[0]
        route = routes.get((self.command, path))
        if route is not None:
            self._send(self._called(route, body))
        elif any(known == path for _, known in routes):
            fact = f"{path}: does not accept {self.command}"
            self._send(error_response(HTTPStatus.METHOD_NOT_ALLOWED, fact))
        else:
            known = ", ".join(sorted({known for _, known in routes}))
            self._send(error_response(HTTPStatus.NOT_FOUND, f"path: is not one of {known}"))

    def _called(self, route: Route, body: bytes) -> Response:
        """Call the function of a route and return its response; meanwhile the connection keeps its slot."""
        self._server.slots.answering(self.connection, now=True)
        try:
            return route(body)
        finally:
            self._server.slots.answering(self.connection, now=False)

    def _send(self, response: Response) -> None:
        self.connection.settimeout(self._server.deadline_s)
        self.send_response(response.status)
        self.send_header("Content-Type", response.content_type)
        self.send_header("Content-Length", str(len(response.body)))
        self.end_headers()
        self.wfile.write(response.body)


class _Reader(io.RawIOBase):
    """Reads at most MOST_REQUEST_BYTES from a connection; raises an error after the deadline."""

    def __init__(self, connection: socket.socket, deadline_s: float) -> None:
        self._connection = connection
        self._ends = time.monotonic() + deadline_s
        self._left = MOST_REQUEST_BYTES

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        wait_s = self._ends - time.monotonic()
        if wait_s <= 0.0:
            raise TimeoutError("the request is not complete at its deadline")
        if self._left <= 0:
            raise ConnectionAbortedError(f"the request is longer than {MOST_REQUEST_BYTES} bytes")
        self._connection.settimeout(wait_s)
        count = self._connection.recv_into(buffer)
        self._left -= count
        return count
