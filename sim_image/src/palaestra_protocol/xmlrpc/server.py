"""An XML-RPC server on one port, for the ROS master and for nodes.

A connection stays open for further calls, because ROS clients expect that. The number of connections, the
length of a request and the duration of every wait are limited. If all connections are in use, a new
connection replaces an idle connection (`connection_limits`). One request may contain several calls
(`system.multicall`); the server makes them in their order.
"""

from __future__ import annotations

import io
import socket
import time
import xmlrpc.client
from collections.abc import Callable, Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler
from typing import Any, cast

from palaestra_protocol.connection_limits import ConnectionSlots
from palaestra_protocol.tcp_server import TcpServer
from palaestra_protocol.xmlrpc.documents import (
    FAULT,
    UnreadableDocument,
    decode_request,
    encode_fault,
    encode_response,
)

MOST_REQUEST_BYTES = 8 << 20  # a robot's description is a parameter, and may have a few MB
MOST_CONNECTIONS = 256  # each connection has a thread; a simulator keeps one connection for each robot
REQUEST_S = 10.0  # time limit for reading a request after its first byte, and for sending the response
IDLE_S = 60.0  # time limit of the wait for the next request
_MULTICALL = "system.multicall"

_LOOPBACK = frozenset({"localhost", "127.0.0.1"})

Method = Callable[[tuple[Any, ...]], Any]
"""Takes the parameters of a call and returns its value."""


def host_name(environment: Mapping[str, str]) -> str:
    """Return the name by which other nodes reach this machine: ROS_HOSTNAME, else ROS_IP, else host name."""
    return environment.get("ROS_HOSTNAME") or environment.get("ROS_IP") or socket.gethostname()


def bind_address(host: str) -> str:
    """Return the address on which a ROS node named `host` listens: loopback, or "" for all interfaces."""
    return "127.0.0.1" if host in _LOOPBACK else ""


class RpcServer(TcpServer):
    """A server on one port; see `TcpServer`.

    Args:
        address: host and port on which the server listens; port 0 means that the system chooses a free port.
        find: returns the method with a name, or None. The server calls methods in several threads.
        request_s: time limit for reading a request after its first byte, and for sending the response.
        idle_s: time limit of the wait for the next request.

    Raises:
        OSError: the address is in use, or does not belong to this machine.
    """

    request_queue_size = 128
    poll_s = 0.05
    ends_connections = True

    def __init__(
        self,
        address: tuple[str, int],
        find: Callable[[str], Method | None],
        *,
        request_s: float = REQUEST_S,
        idle_s: float = IDLE_S,
    ) -> None:
        self.address_family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        self.request_s = request_s
        self.idle_s = idle_s
        self._find = find
        super().__init__(
            address, _Handler, name="XML-RPC", slots=ConnectionSlots(MOST_CONNECTIONS, MOST_CONNECTIONS)
        )

    def respond(self, data: bytes) -> bytes:
        """Return the response to a request."""
        try:
            method, parameters = decode_request(data)
            value = self._several(parameters) if method == _MULTICALL else self._called(method, parameters)
            return encode_response(value)
        except xmlrpc.client.Fault as fault:
            return encode_fault(fault.faultString)
        # TypeError and OverflowError: XML-RPC cannot express the value.
        except (UnreadableDocument, TypeError, OverflowError) as error:
            return encode_fault(str(error))

    def _called(self, name: str, parameters: tuple[Any, ...]) -> Any:
        method = self._find(name)
        if method is None:
            raise xmlrpc.client.Fault(FAULT, f"{name} is not a method of this server")
        try:
            return method(parameters)
        except Exception as error:  # after any error, the caller must get a response
            raise xmlrpc.client.Fault(FAULT, f"{name}: {error!r}") from error

    def _several(self, parameters: tuple[Any, ...]) -> list[Any]:
        match parameters:
            case (list(calls),):
                return [self._one_of_several(each) for each in calls]
        raise xmlrpc.client.Fault(FAULT, f"{_MULTICALL} takes one list of calls")

    def _one_of_several(self, wanted: Any) -> Any:
        """Return a list with the value of the call `wanted`; if the call fails, a mapping with the fault."""
        try:
            match wanted:
                case {"methodName": str(name), "params": list(parameters)} if name != _MULTICALL:
                    return [self._called(name, tuple(parameters))]
                case _:
                    return {
                        "faultCode": FAULT,
                        "faultString": "each call needs a methodName and a list of params",
                    }
        except xmlrpc.client.Fault as fault:  # the other calls of the request are still made
            return {"faultCode": fault.faultCode, "faultString": fault.faultString}


class _Handler(BaseHTTPRequestHandler):
    """Handles the requests of one connection."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    wbufsize = -1  # a response is sent in one piece

    def setup(self) -> None:
        super().setup()
        self.rfile.close()
        self._reader = _Reader(self.connection, self._server)
        self.rfile = io.BufferedReader(self._reader)

    def version_string(self) -> str:
        return "palaestra"

    def handle_one_request(self) -> None:
        self._reader.renew()
        super().handle_one_request()

    def do_POST(self) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdecimal():
            self._refuse(HTTPStatus.LENGTH_REQUIRED)
        elif len(length) > len(str(MOST_REQUEST_BYTES)) or int(length) > MOST_REQUEST_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        elif len(body := self.rfile.read(int(length))) < int(length):
            self.close_connection = True
        else:
            self._send(self._responded(body))

    def log_message(self, *_: Any, **__: Any) -> None:
        """Log nothing."""

    @property
    def _server(self) -> RpcServer:
        return cast("RpcServer", self.server)

    def _responded(self, body: bytes) -> bytes:
        """Return the response to a request; meanwhile the connection keeps its slot."""
        self._server.slots.answering(self.connection, now=True)
        try:
            return self._server.respond(body)
        finally:
            self._server.slots.answering(self.connection, now=False)

    def _refuse(self, status: HTTPStatus) -> None:
        self.close_connection = True
        self.send_error(status)

    def _send(self, body: bytes) -> None:
        self.connection.settimeout(self._server.request_s)
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", "text/xml")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


class _Reader(io.RawIOBase):
    """Reads a connection; limits the wait for a request, and the time to read the rest of the request."""

    def __init__(self, connection: socket.socket, server: RpcServer) -> None:
        self._connection = connection
        self._server = server
        self._ends: float | None = None

    def readable(self) -> bool:
        return True

    def renew(self) -> None:
        """Prepare for the next request: until its first byte, only the limit for idle connections applies."""
        self._ends = None

    def readinto(self, buffer: Any) -> int:
        wait_s = self._server.idle_s if self._ends is None else self._ends - time.monotonic()
        if wait_s <= 0.0:
            raise TimeoutError("the request is not complete at its deadline")
        self._connection.settimeout(wait_s)
        count = self._connection.recv_into(buffer)
        if self._ends is None:
            self._ends = time.monotonic() + self._server.request_s
        return count
