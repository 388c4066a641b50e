"""The connection slots of a server: limited in total and for each peer; new connections come first.

A kubelet's probe sends its request as soon as it is connected. So an idle connection, one whose request is
not yet complete, loses its slot to a new one. If the peer of the new connection has reached its limit, that
peer's oldest idle connection is closed, so a peer with many connections starves only itself. A connection
whose request is complete keeps its slot until the response is ready.
"""

import contextlib
import socket
import threading
from dataclasses import dataclass

MOST_CONNECTIONS = 32
MOST_OF_PEER = 16


@dataclass(slots=True)
class _Slot:
    """The slot of one connection: its peer's address, and whether the server is processing its request."""

    peer: str
    answering: bool = False


class ConnectionSlots:
    """The connections that have a slot; safe to use from several threads.

    Args:
        most: number of slots.
        most_of_peer: number of slots that one peer may take.
    """

    def __init__(self, most: int = MOST_CONNECTIONS, most_of_peer: int = MOST_OF_PEER) -> None:
        self._most = most
        self._most_of_peer = most_of_peer
        self._lock = threading.Lock()
        self._taken: dict[socket.socket, _Slot] = {}  # the oldest first

    def take(self, connection: socket.socket, peer: str) -> bool:
        """Return whether a new connection got a slot; if all are taken, close the oldest idle connection."""
        with self._lock:
            if (crowd := self._crowd(peer)) is not None:
                idle = next((one for one in crowd if not self._taken[one].answering), None)
                if idle is None:
                    return False
                self._drop(idle)
            self._taken[connection] = _Slot(peer)
            return True

    def answering(self, connection: socket.socket, *, now: bool) -> None:
        """Record whether the server is processing the request of a connection."""
        with self._lock:
            if slot := self._taken.get(connection):
                slot.answering = now

    def leave(self, connection: socket.socket) -> None:
        """Free the slot of a connection, if it still has one."""
        with self._lock:
            self._taken.pop(connection, None)

    def clear(self) -> None:
        """Close every connection, also those whose request is being processed."""
        with self._lock:
            for connection in list(self._taken):
                self._drop(connection)

    def _crowd(self, peer: str) -> list[socket.socket] | None:
        """Return the connections from which one must be closed for `peer`; None if a slot is free."""
        of_peer = [one for one, slot in self._taken.items() if slot.peer == peer]
        if len(of_peer) >= self._most_of_peer:
            return of_peer
        return list(self._taken) if len(self._taken) >= self._most else None

    def _drop(self, connection: socket.socket) -> None:
        """Close a connection; the thread that reads from it ends."""
        del self._taken[connection]
        with contextlib.suppress(OSError):  # the peer may have closed it already
            connection.shutdown(socket.SHUT_RDWR)
