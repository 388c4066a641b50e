"""A trainer's /status at a loopback address, for operators under test that request the status of pods."""

import http.server
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import BinaryIO

from palaestra.plan.layout import STATUS_PORT
from palaestra_protocol.pod.status import TrainerStatus

HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: application/json\r\n"


class StatusServer:
    """The HTTP server of a trainer's status, which serves until `close`.

    Attributes:
        host: its address.
    """

    def __init__(self, answer: Callable[[BinaryIO], object]) -> None:
        """Start the server.

        For each request, a separate thread calls `answer`, which writes head and body.
        """

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                with suppress(OSError):  # an operator disconnects when it has read enough
                    answer(self.wfile)

            def log_message(self, *_: object) -> None:
                """Print nothing."""

        self._server = _at_a_free_address(Handler)
        self.host = str(self._server.server_address[0])
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop the server."""
        self._server.shutdown()
        self._thread.join()
        self._server.server_close()


@contextmanager
def serving(status: Callable[[], TrainerStatus]) -> Iterator[str]:
    """Serve the result of `status` for each request, and yield the address."""
    server = StatusServer(lambda out: out.write(b"".join(answer(status()))))
    try:
        yield server.host
    finally:
        server.close()


def answer(status: TrainerStatus) -> tuple[bytes, bytes]:
    """Return head and body of a trainer's response."""
    body = json.dumps(status.to_json()).encode()
    return HEAD + b"Content-Length: %d\r\n\r\n" % len(body), body


def _at_a_free_address(
    handler: type[http.server.BaseHTTPRequestHandler],
) -> http.server.ThreadingHTTPServer:
    for last in range(1, 255):
        with suppress(OSError):  # another run of the tests may use the address
            return http.server.ThreadingHTTPServer((f"127.90.90.{last}", STATUS_PORT), handler)
    raise AssertionError(f"port {STATUS_PORT} is taken at every address")
