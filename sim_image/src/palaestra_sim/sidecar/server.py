"""The two listeners of a sidecar, and nothing of what they mean to the simulator.

Control is for the trainer of the same pod and has no authentication, so it listens on loopback only.
Health is for everybody who may reach the pod, so it only tells. Both are small on purpose: a request
has a size, a time, and a place among a bounded number of others, and each connection is one request.
"""

import ipaddress
import json
import socket
import socketserver
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, cast

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest

from palaestra_protocol.control import STANDBY, PlainRequest, ProtocolError, StopRequest, decoded
from palaestra_sim.sidecar.errors import SidecarError
from palaestra_sim.sidecar.lifecycle import Event
from palaestra_sim.sidecar.simulator import Answer, NoAnswer, Simulator

MOST_BODY_BYTES = 4096
_MOST_CONNECTIONS = 32
_TIMEOUT_S = 5.0
_ABOVE = ("", STANDBY)  # the paths of the first simulator, and of one that stands by for it
_MOST_PORT = 65535


@dataclass(frozen=True, slots=True, kw_only=True)
class Address:
    """Where to listen; port 0 takes one that is free."""

    host: str
    port: int

    @classmethod
    def parse(cls, text: str) -> "Address":
        """Return the address of `127.0.0.1:7100` or `[::1]:7100`.

        Raises:
            ValueError: it is none, or has no port from 0 to 65535.
        """
        host, _, port = text.rpartition(":")
        bare = host.removeprefix("[").removesuffix("]")
        try:
            ipaddress.ip_address(bare)
            if 0 <= int(port) <= _MOST_PORT:
                return cls(host=bare, port=int(port))
        except ValueError:
            pass
        raise ValueError(f"{text!r} is no address such as 127.0.0.1:7100")

    def __str__(self) -> str:
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """What is answered: a status, and a body of some type."""

    status: HTTPStatus
    body: bytes
    content_type: str = "application/json"


Route = Callable[[bytes], Response]
Routes = Mapping[tuple[str, str], Route]


def control_routes(simulators: Sequence[Simulator]) -> Routes:
    """Return what the control port can do; see `palaestra_protocol.control`."""
    routes: dict[tuple[str, str], Route] = {}
    for above, simulator in zip(_ABOVE, simulators, strict=False):
        routes |= {
            ("GET", f"{above}/state"): _state(simulator),
            ("POST", f"{above}/start"): _plain(simulator, Event.START),
            ("POST", f"{above}/ready"): _plain(simulator, Event.READY),
            ("POST", f"{above}/stop"): _stop(simulator),
        }
    return routes


def health_routes(simulators: Sequence[Simulator], registry: CollectorRegistry) -> Routes:
    """Return what the health port can do: answer at all, tell the states, and the metrics."""
    states = {
        ("GET", f"{above}/state"): _state(simulator)
        for above, simulator in zip(_ABOVE, simulators, strict=False)
    }
    return states | {
        ("GET", "/healthz"): lambda _: Response(
            status=HTTPStatus.OK, body=b"ok\n", content_type="text/plain"
        ),
        ("GET", "/metrics"): lambda _: Response(
            status=HTTPStatus.OK, body=generate_latest(registry), content_type=CONTENT_TYPE_LATEST
        ),
    }


class Listener(socketserver.ThreadingTCPServer):
    """One port: bound when made, answering when `serve` was called.

    Args:
        option: the option that the address comes from, for messages.
        address: where to listen.

    Raises:
        SidecarError: the address is in use, or not of this machine.
    """

    allow_reuse_address = True
    daemon_threads = True
    request_queue_size = _MOST_CONNECTIONS
    routes: Routes

    def __init__(self, option: str, address: Address) -> None:
        self.address_family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self._places = threading.BoundedSemaphore(_MOST_CONNECTIONS)
        try:
            super().__init__((address.host, address.port), _Handler)
        except OSError as error:
            remedy = "choose another, or 0 for a free one"
            raise SidecarError(f"{option}: {address}: {error.strerror}; {remedy}") from error

    @property
    def address(self) -> Address:
        """Where it listens, with the port that was free."""
        host, port = self.socket.getsockname()[:2]
        return Address(host=host, port=port)

    def serve(self, routes: Routes) -> None:
        """Answer from now on, in threads of its own."""
        self.routes = routes
        threading.Thread(target=self.serve_forever, name=str(self.address), daemon=True).start()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Give a connection a thread, or close it when too many are open."""
        if self._places.acquire(blocking=False):
            super().process_request(request, client_address)
        else:
            self.shutdown_request(request)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Answer one connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self._places.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Say nothing: a client that goes away in the middle is no news of ours."""


class _Handler(BaseHTTPRequestHandler):
    """One request, by the routes of its listener."""

    timeout = _TIMEOUT_S
    server_version = "palaestra-sidecar"
    sys_version = ""

    def do_GET(self) -> None:
        """Answer a GET."""
        self._answer(b"")

    def do_POST(self) -> None:
        """Answer a POST, if its body has a length, and one that is not too long."""
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdecimal():
            self._send(_error(HTTPStatus.LENGTH_REQUIRED, "Content-Length: is missing"))
        elif len(length) > len(str(MOST_BODY_BYTES)) or int(length) > MOST_BODY_BYTES:
            fact = f"body: more than {MOST_BODY_BYTES} bytes"
            self._send(_error(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, fact))
        else:
            self._answer(self.rfile.read(int(length)))

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - http.server's signature
        """Say nothing: what a request changed is said by the simulator."""

    def _answer(self, body: bytes) -> None:
        routes, path = cast("Listener", self.server).routes, self.path.partition("?")[0]
        route = routes.get((self.command, path))
        if route is not None:
            self._send(route(body))
        elif any(known == path for _, known in routes):
            self._send(_error(HTTPStatus.METHOD_NOT_ALLOWED, f"{path}: does not take {self.command}"))
        else:
            known = ", ".join(sorted({known for _, known in routes}))
            self._send(_error(HTTPStatus.NOT_FOUND, f"path: is not one of {known}"))

    def _send(self, response: Response) -> None:
        self.send_response(response.status)
        self.send_header("Content-Type", response.content_type)
        self.send_header("Content-Length", str(len(response.body)))
        self.end_headers()
        self.wfile.write(response.body)


def _state(simulator: Simulator) -> Route:
    """Return the route of a question for a simulator's state."""
    return lambda _: _json(HTTPStatus.OK, simulator.told().to_json())


def _plain(simulator: Simulator, event: Event) -> Route:
    """Return the route of a request that says nothing but its name."""

    def route(body: bytes) -> Response:
        try:
            PlainRequest.from_json(decoded(body or b"{}"))
        except ProtocolError as error:
            return _error(HTTPStatus.BAD_REQUEST, str(error))
        return _asked(lambda: simulator.ask(event))

    return route


def _stop(simulator: Simulator) -> Route:
    """Return the route of an announced end."""

    def route(body: bytes) -> Response:
        try:
            request = StopRequest.from_json(decoded(body))
        except ProtocolError as error:
            return _error(HTTPStatus.BAD_REQUEST, str(error))
        return _asked(lambda: simulator.ask(Event.STOP, request.deadline_s))

    return route


def _asked(ask: Callable[[], Answer]) -> Response:
    """Return what the simulator's owner says to a request."""
    try:
        answer = ask()
    except NoAnswer as error:
        return _error(HTTPStatus.SERVICE_UNAVAILABLE, str(error))
    return _json(HTTPStatus.OK if answer.allowed else HTTPStatus.CONFLICT, answer.state.to_json())


def _error(status: HTTPStatus, fact: str) -> Response:
    return _json(status, {"error": fact})


def _json(status: HTTPStatus, content: Mapping[str, Any]) -> Response:
    return Response(status=status, body=json.dumps(content).encode() + b"\n")
