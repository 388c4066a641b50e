"""A TCP server with a limited number of connections, each in its own thread; the base class of our servers.

A subclass supplies the handler that reads requests. While the handler processes a request, the handler marks
its connection as busy in `slots`, so that the server does not close this connection in favor of a newer one.
"""

import logging
import socketserver
import sys
import threading
from types import TracebackType
from typing import Any, Self

from palaestra_protocol.connection_limits import ConnectionSlots

log = logging.getLogger(__name__)


class TcpServer(socketserver.ThreadingTCPServer):
    """A server on one port; the constructor binds the port, and requests are served from `start` to `close`.

    Attributes:
        poll_s: maximum duration of `close`.
        ends_connections: whether `close` closes the open connections too.

    Args:
        address: host and port on which the server listens; port 0 means that the system chooses a free port.
        handler: the class that serves one connection.
        name: the name of the server in its log and of its thread.
        slots: the slots of the server's connections.

    Raises:
        OSError: the address is in use, or does not belong to this machine.
    """

    allow_reuse_address = True
    daemon_threads = True
    poll_s = 0.1
    ends_connections = False

    def __init__(
        self,
        address: tuple[str, int],
        handler: type[socketserver.BaseRequestHandler],
        *,
        name: str,
        slots: ConnectionSlots,
    ) -> None:
        self.name = name
        self.slots = slots
        self._thread: threading.Thread | None = None
        super().__init__(address, handler)

    @property
    def port(self) -> int:
        """The port on which the server listens."""
        return int(self.socket.getsockname()[1])

    def start(self) -> None:
        """Start to serve requests, in new threads."""
        self._thread = threading.Thread(
            target=self.serve_forever, args=(self.poll_s,), name=self.name, daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        """Stop accepting connections, and free the address."""
        if self._thread is not None:
            self.shutdown()
            self._thread.join()
        self.server_close()
        if self.ends_connections:
            self.slots.clear()

    def __enter__(self) -> Self:
        """Start to serve requests."""
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop serving requests and free the address."""
        self.close()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Start a thread for a connection; if no slot is available, close the connection."""
        if not self.slots.take(request, client_address[0]):
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except RuntimeError:  # the system cannot start another thread
            self.slots.leave(request)
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve one connection."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.slots.leave(request)

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ARG002 - socketserver's
        """Log an error of this program; the disconnection of a client is not logged."""
        error = sys.exception()
        if not isinstance(error, OSError):
            log.error("%s: a request failed: %r", self.name, error)
