"""The connection slots of a server: their number is limited, in total and for each peer.

A connection is idle while its request is not complete. If no slot is free, a new connection takes the slot of
the oldest idle connection. So clients that connect and send nothing cannot block a kubelet's probe, which
sends its request as soon as it is connected.

If the peer of the new connection has reached its own limit, an idle connection of the same peer is closed. So
a peer with many connections cannot take the slots of other peers. A connection with a complete request keeps
its slot until the response is ready.
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
        self._taken: dict[socket.socket, _Slot] = {}  # the oldest connection first

    def take(self, connection: socket.socket, peer: str) -> bool:
        """Give a new connection a slot, and return True; return False if the server is busy.

        If all slots are taken, the oldest idle connection is closed. If no connection is idle, the server is
        busy.
        """
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
        """Free the slot of a connection, if the connection still has a slot."""
        with self._lock:
            self._taken.pop(connection, None)

    def clear(self) -> None:
        """Close every connection, also those whose request is being processed."""
        with self._lock:
            for connection in list(self._taken):
                self._drop(connection)

    def _crowd(self, peer: str) -> list[socket.socket] | None:
        """Return the connections of which one must close to give `peer` a slot; None if a slot is free."""
        of_peer = [one for one, slot in self._taken.items() if slot.peer == peer]
        if len(of_peer) >= self._most_of_peer:
            return of_peer
        return list(self._taken) if len(self._taken) >= self._most else None

    def _drop(self, connection: socket.socket) -> None:
        """Close a connection; this also ends the thread that reads from the connection."""
        del self._taken[connection]
        with contextlib.suppress(OSError):  # the peer may have closed the connection already
            connection.shutdown(socket.SHUT_RDWR)
