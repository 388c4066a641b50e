"""Free ports, chosen all at once and held for as long as the run needs them.

If a free port were released after the choice, another program could take it before the container listens. So
each port stays bound here, without listening. The kernel gives a bound port neither to a program that asks
for any port nor to an outgoing connection. SO_REUSEADDR, which containers set too, lets them listen on it.
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
        """Return a free port, held."""
        return self._bind(0)

    def this(self, port: int) -> int:
        """Return `port`, held.

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
        """Give all of them back."""
        self._sockets.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None
    ) -> None:
        self.close()
