"""The HTTP server of a trainer for /status, /metrics and /healthz."""

from __future__ import annotations

import errno
import json
import threading
from collections.abc import Mapping
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from types import MappingProxyType, TracebackType
from typing import Self, cast

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from palaestra_protocol.metrics import Family, Values
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.telemetry import metrics
from palaestra_trainer.telemetry.progress import Progress

READ_DEADLINE_S = 5.0


class StatusServer:
    """Answers requests while it is entered.

    Args:
        address: `host:port`; port 0 takes a free one.
        progress: the state of the run.
        known: metrics that do not change, see `metrics.constants`.

    Raises:
        ConfigurationError: the address is in use, or does not belong to this machine.
    """

    def __init__(
        self, address: str, progress: Progress, known: Mapping[Family, Values] = MappingProxyType({})
    ) -> None:
        host, _, port = address.rpartition(":")
        try:
            self._server = _Server((host, int(port)), _Handler)
        except (OSError, OverflowError) as error:
            taken = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
            fact = "is in use" if taken else f"cannot be listened on ({error})"
            raise ConfigurationError(
                f"statusAddress: {address} {fact}; choose another address or free it"
            ) from error
        self._server.progress = progress
        self._server.registry = metrics.registry(progress, known)
        self._thread = threading.Thread(
            target=self._server.serve_forever, kwargs={"poll_interval": 0.1}, name="status", daemon=True
        )

    @property
    def address(self) -> str:
        """The address on which it listens, as `host:port`."""
        host, port = self._server.server_address[:2]
        return f"{host!s}:{port}"

    def start(self) -> None:
        """Begin to answer requests, until the process ends or the context is left."""
        self._thread.start()

    def __enter__(self) -> Self:
        """Begin to answer requests."""
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop answering and release the address."""
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    progress: Progress
    registry: CollectorRegistry


class _Handler(BaseHTTPRequestHandler):
    timeout = READ_DEADLINE_S

    def do_GET(self) -> None:
        server = cast("_Server", self.server)
        match self.path:
            case "/status":
                self._answer("application/json", json.dumps(server.progress.status().to_json()))
            case "/metrics":
                text = generate_latest(server.registry).decode()
                self._answer(CONTENT_TYPE_PLAIN_0_0_4, text)
            case "/healthz":
                self._answer("text/plain", "ok\n")
            case _:
                self.send_error(HTTPStatus.NOT_FOUND)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - http.server's name
        """Log nothing: probes send a request every few seconds."""

    def _answer(self, content_type: str, text: str) -> None:
        body = text.encode()
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", content_type)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)
