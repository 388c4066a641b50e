"""The operator's HTTP server: liveness, readiness and metrics.

Every client that reaches the pod may send requests, so they only read. Each connection has a deadline, and
the number of connections is limited.
"""

import threading
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, cast

from prometheus_client import CONTENT_TYPE_LATEST

from palaestra.errors import PalaestraError

PLAIN = "text/plain; charset=utf-8"
TIMEOUT_S = 5.0
MOST_CONNECTIONS = 16

Trouble = Callable[[], str | None]  # returns the problem in a sentence; None: there is none


class HealthServer(ThreadingHTTPServer):
    """Serves /healthz, /readyz and /metrics from the moment it is made until it is closed.

    Args:
        address: host and port; port 0 takes a free one.
        healthy: returns a problem that only a restart solves.
        ready: returns what the operator still waits for.
        metrics: returns the text of the metrics.

    Raises:
        PalaestraError: the address cannot be listened on.
    """

    daemon_threads = True
    block_on_close = False
    allow_reuse_address = True

    def __init__(
        self, address: tuple[str, int], *, healthy: Trouble, ready: Trouble, metrics: Callable[[], bytes]
    ) -> None:
        self.routes: dict[str, Callable[[], tuple[HTTPStatus, str, bytes]]] = {
            "/healthz": lambda: _told(healthy()),
            "/readyz": lambda: _told(ready()),
            "/metrics": lambda: (HTTPStatus.OK, CONTENT_TYPE_LATEST, metrics()),
        }
        self._places = threading.BoundedSemaphore(MOST_CONNECTIONS)
        try:
            super().__init__(address, _Handler)
        except OSError as error:
            host, port = address
            raise PalaestraError(
                f"--metrics-address: {host}:{port}: {error.strerror}; choose a free one"
            ) from error
        threading.Thread(target=self.serve_forever, name="health", daemon=True).start()

    @property
    def shown(self) -> str:
        """Return where it serves, as host:port."""
        host, port = self.server_address[:2]
        return f"{host!s}:{port}"

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread, or close it if too many are open."""
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
        """Log nothing: a client that disconnects early is no error of the operator."""


class _Handler(BaseHTTPRequestHandler):
    timeout = TIMEOUT_S

    def do_GET(self) -> None:
        route = cast("HealthServer", self.server).routes.get(self.path.partition("?")[0])
        status, kind, body = route() if route else (HTTPStatus.NOT_FOUND, PLAIN, b"not found\n")
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: A002 - the library's name
        """Log nothing: probes and scrapes come every few seconds."""


def _told(trouble: str | None) -> tuple[HTTPStatus, str, bytes]:
    if trouble is None:
        return HTTPStatus.OK, PLAIN, b"ok\n"
    return HTTPStatus.SERVICE_UNAVAILABLE, PLAIN, f"{trouble}\n".encode()
