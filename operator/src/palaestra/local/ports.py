"""Choose free ports for a run, and reserve them while the run needs them.

If a free port were released after the choice, another program could take the port before the container
listens. So a socket of this process stays bound to each port, but does not listen. The kernel does not assign
a bound port to a program that requests any free port, nor to an outgoing connection. Containers can still
listen on the port, because they set SO_REUSEADDR too.
"""

import socket
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from palaestra.local.errors import RunRefused

LOOPBACK = "127.0.0.1"


class HeldPorts:
    """Ports of the loopback interface that stay reserved for this run until `close`."""

    def __init__(self) -> None:
        self._sockets = ExitStack()

    def any(self) -> int:
        """Reserve and return a free port."""
        return self._bind(0)

    def this(self, port: int) -> int:
        """Reserve and return `port`.

        Raises:
            RunRefused: another program uses the port.
        """
        try:
            return self._bind(port)
        except OSError as error:
            raise RunRefused(
                f"port {port}: {error.strerror or error}; "
                "choose another with --ros-port, or remove the option to get a free port"
            ) from error

    def _bind(self, port: int) -> int:
        held = self._sockets.enter_context(socket.socket(socket.AF_INET, socket.SOCK_STREAM))
        held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        held.bind((LOOPBACK, port))
        return int(held.getsockname()[1])

    def close(self) -> None:
        """Release all ports."""
        self._sockets.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self.close()
