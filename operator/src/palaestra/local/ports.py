"""Free ports, all chosen at the same time and held while the run needs them.

If a free port were released after the choice, another program could take it before the container listens. So
each port stays bound here, without listening. The kernel does not assign a bound port to a program that
requests any port, nor to an outgoing connection. Containers can still listen on it, because they set
SO_REUSEADDR too.
"""

import socket
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from palaestra.local.errors import RunRefused

LOOPBACK = "127.0.0.1"


class HeldPorts:
    """Ports of the loopback interface that no other program gets until `close`."""

    def __init__(self) -> None:
        self._sockets = ExitStack()

    def any(self) -> int:
        """Hold and return a free port."""
        return self._bind(0)

    def this(self, port: int) -> int:
        """Hold and return `port`.

        Raises:
            RunRefused: another program has it.
        """
        try:
            return self._bind(port)
        except OSError as error:
            raise RunRefused(
                f"port {port}: {error.strerror or error}; "
                "choose another with --ros-port, or leave it out for a free one"
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
