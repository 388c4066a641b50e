"""Make one XML-RPC call over a new connection, with a deadline for the whole call."""

from __future__ import annotations

import http.client
import io
import socket
import time
from typing import Any, cast
from urllib.parse import urlsplit

from palaestra_protocol.xmlrpc.documents import UnreadableDocument, decode_response, encode_request

MOST_RESPONSE_BYTES = 2**20


def call(uri: str, deadline_s: float, method: str, *parameters: Any) -> Any:
    """Call a method of a server and return the value.

    Args:
        uri: the URI of the server, e.g. http://localhost:11311/
        deadline_s: time limit for the whole call, from the connection to the last byte of the response.
        method: the name of the method.
        parameters: the parameters of the method.

    Raises:
        OSError: the server cannot be reached; TimeoutError: the deadline passed.
        UnreadableDocument: the URI is invalid, or the response is too long or is not XML-RPC.
        xmlrpc.client.Fault: the server reported that the call failed.
        TypeError, OverflowError: XML-RPC cannot express a parameter.
    """
    ends = time.monotonic() + deadline_s
    host, port, path = _parts(uri)
    body = encode_request(method, parameters)
    head = (
        f"POST {path} HTTP/1.0\r\nHost: {host}:{port}\r\nUser-Agent: palaestra\r\n"
        f"Content-Type: text/xml\r\nContent-Length: {len(body)}\r\n\r\n"
    )
    with socket.create_connection((host, port), timeout=deadline_s) as connection:
        connection.settimeout(_left(ends))
        connection.sendall(head.encode("ascii") + body)
        return decode_response(_body(_Stream(connection, ends)))


def _parts(uri: str) -> tuple[str, int, str]:
    try:
        parts = urlsplit(uri)
        if parts.scheme == "http" and parts.hostname and parts.port and uri.isascii():
            # For an invalid host name, `encode` raises UnicodeError, a ValueError. Without this call, the
            # lookup of the address would raise it later.
            parts.hostname.encode("idna")
            return parts.hostname, parts.port, parts.path or "/"
    except ValueError:
        pass
    raise UnreadableDocument(f"{uri!r} is not an address such as http://localhost:11311/")


def _left(ends: float) -> float:
    left_s = ends - time.monotonic()
    if left_s <= 0.0:
        raise TimeoutError("the call did not end before its deadline")
    return left_s


class _Stream(io.RawIOBase):
    """Reads a response; raises an error after the deadline, or if the response is too long."""

    def __init__(self, connection: socket.socket, ends: float) -> None:
        self._connection = connection
        self._ends = ends
        self._room = MOST_RESPONSE_BYTES

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        self._connection.settimeout(_left(self._ends))
        count = self._connection.recv_into(buffer)
        self._room -= count
        if self._room < 0:
            raise UnreadableDocument(f"the response is longer than {MOST_RESPONSE_BYTES} bytes")
        return count

    def makefile(self, _mode: str) -> io.BufferedReader:
        """Return a reader; `http.client` calls this method of a socket."""
        return io.BufferedReader(self)


def _body(stream: _Stream) -> bytes:
    # HTTPResponse calls only the method `makefile` of its socket.
    response = http.client.HTTPResponse(cast("socket.socket", stream))
    try:
        response.begin()
        if response.status != http.client.OK:
            raise UnreadableDocument(f"the response has the HTTP status {response.status}, not 200")
        return response.read()
    except http.client.HTTPException as error:
        raise UnreadableDocument(f"the response is not HTTP: {error!r}") from error
