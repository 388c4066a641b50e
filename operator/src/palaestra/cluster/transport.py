"""Send requests and read responses as bytes, with a deadline for the whole response.

This module replaces the official client, whose models need ten times the time and twice the memory of plain
JSON. Also, the calls of the official client have no deadline for the body of a response.
"""

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from socket import socket
from typing import Any
from urllib.parse import urlencode

from urllib3 import BaseHTTPResponse, HTTPHeaderDict, Timeout
from urllib3.exceptions import HTTPError, ProtocolError

from palaestra.cluster.client_config import Access, Headers
from palaestra.cluster.connection_pool import dialed
from palaestra.cluster.errors import ApiError, TooManyRequests, Unreachable, Untrusted, from_status
from palaestra.cluster.timeouts import Timeouts
from palaestra.cluster.tls import refused_certificate

OnRequest = Callable[[str, str, int, float], None]
CHUNK = 1 << 16
# Limit of a response; an object has at most 1.5 MiB, and few of the 500 objects of a page are large.
MOST_BYTES = 1 << 26
SWITCHED = 101  # HTTP status: switching to the websocket protocol
FIRST_ERROR = 400
JSON = "application/json"


class ConnectionBroke(Unreachable):
    """The connection broke before the end of the response; a read may be repeated at once."""


def nothing(verb: str, resource: str, code: int, seconds: float) -> None:
    """Do nothing; the default of `on_request`."""
    del verb, resource, code, seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Call:
    """One request.

    Attributes:
        verb: the verb in metrics and RBAC: `list`, `get`, `create`, `patch`, `apply`, `delete`, `watch`.
        plural: the plural name of the kind, for metrics.
        path: the path from the root of the API server.
        query: the parameters of the URL. A parameter with the value None is left out; for a list, the name is
            repeated for each item.
        accept: the requested media type of the response.
        body: an object, which is sent as JSON.
        waits: whether to retry within the deadline if the server responds with 429.
    """

    verb: str
    plural: str
    path: str
    method: str = "GET"
    query: Mapping[str, str | Sequence[str] | None] = field(default_factory=dict)
    accept: str = JSON
    body: Mapping[str, Any] | None = None
    media_type: str = JSON
    waits: bool = True

    def sending(self, body: Mapping[str, Any], *, method: str, media_type: str = JSON) -> "Call":
        """Return the same request with a body."""
        return replace(self, body=body, method=method, media_type=media_type)

    @property
    def address(self) -> str:
        """The path with the query."""
        given = {key: value for key, value in self.query.items() if value is not None}
        query = urlencode(given, doseq=True)
        return f"{self.path}?{query}" if query else self.path


class Transport:
    """Connections to one API server with one identity; several threads may use one object.

    Attributes:
        limits: the deadlines and the waits before retries.
        on_request: called after every request.
    """

    def __init__(self, access: Access, limits: Timeouts) -> None:
        self.limits = limits
        self.on_request: OnRequest = nothing
        self.host = access.host
        self._access = access
        self._pool = access.pool
        self._credentials = threading.Lock()

    def call(self, call: Call, call_s: float) -> dict[str, Any]:
        """Return the object in the response to one request.

        The call takes at most twice `call_s`, even if the response arrives byte by byte.

        Raises:
            ApiError: the API server refuses, cannot be reached, or returns another response than an object.
        """
        deadline = time.monotonic() + call_s
        broke, turned_away = False, 0
        while True:
            try:
                return self._timed(call, deadline)
            # The server rejected the request, so it was certainly not executed.
            except TooManyRequests as error:
                turned_away += 1
                wait_s = error.retry_after_s + self.limits.turned_away.wait_s(turned_away)
                if not call.waits or time.monotonic() + wait_s >= deadline:
                    raise
                threading.Event().wait(wait_s)
            except ConnectionBroke:
                if broke or call.method != "GET" or time.monotonic() >= deadline:
                    raise
                broke = True

    def open(self, call: Call, *, silence_s: float) -> BaseHTTPResponse:
        """Return a streamed response, which the caller must close; a read waits at most `silence_s`.

        Raises:
            ApiError: the API server refuses, or cannot be reached.
        """
        started = time.monotonic()
        try:
            return self._opened(call, Timeout(connect=self.limits.connect_s, read=silence_s))
        except ApiError as error:
            self.on_request(call.verb, call.plural, error.code, time.monotonic() - started)
            raise

    def output(self, call: Call, deadline: float) -> Iterator[bytes]:
        """Start a command in a container, and return an iterator over its standard output; see `pod_exec`.

        Raises:
            ApiError: the API server refuses, or cannot be reached.
        """
        from palaestra.cluster import pod_exec  # noqa: PLC0415 - the operator needs no websockets

        started, code = time.monotonic(), 0
        try:
            headers = (("User-Agent", "palaestra"), *self._authorization(), *self._access.headers)
            command = pod_exec.open_socket(
                self._dial(f"{call.method} {self.host}{call.path}"),
                self.host + call.address,
                headers,
                self.limits.call_s,
            )
            code = SWITCHED
        except ApiError as error:
            code = error.code
            raise
        finally:
            self.on_request(call.verb, call.plural, code, time.monotonic() - started)
        return pod_exec.output(command, deadline)

    def close(self) -> None:
        """Close all idle connections."""
        self._pool.clear()

    def _dial(self, what: str) -> socket:
        try:
            return dialed(self._pool, self.host, self.limits.connect_s)
        except (HTTPError, OSError) as error:
            raise self._unreachable(error, what) from error

    def _opened(self, call: Call, timeout: Timeout) -> BaseHTTPResponse:
        response = self._send(call, timeout)
        if response.status < FIRST_ERROR:
            return response
        try:
            raise self._refusal(response, time.monotonic() + self.limits.call_s)
        finally:
            response.close()

    def _timed(self, call: Call, deadline: float) -> dict[str, Any]:
        started, code = time.monotonic(), 0
        try:
            answer = self._once(call, deadline)
            code = 200
        except ApiError as error:
            code = error.code
            raise
        finally:
            self.on_request(call.verb, call.plural, code, time.monotonic() - started)
        return answer

    def _once(self, call: Call, deadline: float) -> dict[str, Any]:
        left_s = max(deadline - time.monotonic(), 0.001)
        response = self._send(call, Timeout(connect=min(self.limits.connect_s, left_s), read=left_s))
        try:
            return self._answer(response, call, deadline)
        except BaseException:  # also KeyboardInterrupt
            # If the connection stayed open, the next request would read the rest of this response.
            response.close()
            raise
        finally:
            response.release_conn()

    def _answer(self, response: BaseHTTPResponse, call: Call, deadline: float) -> dict[str, Any]:
        if response.status >= FIRST_ERROR:
            raise self._refusal(response, deadline)
        return _decoded(_body(response, deadline), f"{call.method} {self.host}{call.path}")

    def _send(self, call: Call, timeout: Timeout) -> BaseHTTPResponse:
        headers = HTTPHeaderDict({"Accept": call.accept, "User-Agent": "palaestra"})
        if call.body is not None:
            headers["Content-Type"] = call.media_type
        for name, value in (*self._authorization(), *self._access.headers):
            headers.add(name, value.encode().decode("latin-1"))  # the library encodes headers as latin-1
        try:
            return self._pool.request(
                call.method,
                self.host + call.address,
                body=None if call.body is None else json.dumps(call.body).encode(),
                headers=headers,
                timeout=timeout,
                retries=False,
                redirect=False,
                preload_content=False,
            )
        except (HTTPError, OSError) as error:
            raise self._unreachable(error, f"{call.method} {self.host}{call.path}") from error

    def _authorization(self) -> Headers:
        with self._credentials:  # one thread reads the token or runs the plugin, and the other threads wait
            header = self._access.authorization()
        return () if header is None else (("Authorization", header),)

    def _unreachable(self, error: Exception, what: str) -> Unreachable:
        """Return the exception for a request without a response; its message names the proxy."""
        if (refused := refused_certificate(error)) is not None:
            fact, remedy = refused
            return Untrusted(f"{self.host}{self._by_way}: {fact}", remedy)
        return _unreachable(error, f"{what}{self._by_way}")

    @property
    def _by_way(self) -> str:
        return f" by way of the proxy {self._access.proxy.address}" if self._access.proxy else ""

    def _refusal(self, response: BaseHTTPResponse, deadline: float) -> ApiError:
        retry_after = response.headers.get("Retry-After")
        try:
            status = json.loads(_body(response, deadline))
        except ValueError:  # a proxy may respond with HTML
            status = None
        except Unreachable:
            status = None
        return from_status(response.status, status if isinstance(status, dict) else {}, retry_after)


def read_some(response: BaseHTTPResponse) -> bytes:
    """Return the next bytes of a response as soon as they arrive; b"" at the end of the response.

    Raises:
        Unreachable: the connection broke, or was silent for too long.
    """
    try:
        return response.read1(CHUNK)
    # ValueError: another thread has shut down the TLS connection.
    except (HTTPError, OSError, ValueError) as error:
        raise _unreachable(error, "reading the response") from error


def _body(response: BaseHTTPResponse, deadline: float) -> bytes:
    parts, size = [], 0
    while part := read_some(response):
        size += len(part)
        parts.append(part)
        if size > MOST_BYTES:
            raise Unreachable(response.status, "TooLarge", f"the response has more than {MOST_BYTES} bytes")
        if time.monotonic() > deadline:
            raise Unreachable(0, "Timeout", "the response did not end in time")
    return b"".join(parts)


def _decoded(body: bytes, what: str) -> dict[str, Any]:
    try:
        answer = json.loads(body)
    except ValueError as error:
        raise Unreachable(0, "Unreadable", f"{what}: the response is not JSON ({error})") from error
    if not isinstance(answer, dict):
        raise Unreachable(0, "Unreadable", f"{what}: the response is not a JSON object")
    return answer


def _unreachable(error: Exception, what: str) -> Unreachable:
    broke = isinstance(error, (ProtocolError, ConnectionError))
    kind = ConnectionBroke if broke else Unreachable
    return kind(0, "Unreachable", f"{what}: no answer ({error})")
