"""A Unix socket on which the sidecar of a simulator asks for what a viewer sees.

A request is one line; its response is its length, in four bytes with the first one largest, and that many
bytes. Requests are answered in the loop between two steps, one at a time, and nothing is computed without a
request. The socket is a file of this machine, so only processes with rights in its folder can use it.
"""

from __future__ import annotations

import contextlib
import logging
import os
import socket
import struct
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

from palaestra_sim.ros.loop import Loop

LENGTH: Final = struct.Struct(">I")
_MOST_PEERS: Final = 4
_LONGEST_LINE: Final = 64
_BACKLOG: Final = 4

log = logging.getLogger(__name__)

Answers = Mapping[bytes, Callable[[], bytes]]


class LocalSocket:
    """The socket, from its creation to `close`.

    Args:
        loop: the event loop.
        path: of the socket; a file of that name is replaced.
        answers: return the response to each line.

    Raises:
        OSError: the socket cannot be made there.
    """

    def __init__(self, loop: Loop, path: Path, answers: Answers) -> None:
        self._loop = loop
        self._path = path
        self._answers = answers
        self._peers: dict[socket.socket, _Peer] = {}
        self._listener = _listening(path)
        loop.watch(self._listener, self._accept)

    def close(self) -> None:
        """Close the socket and its connections, and remove its file."""
        for peer in list(self._peers.values()):
            peer.close()
        self._loop.forget(self._listener)
        self._listener.close()
        self._path.unlink(missing_ok=True)

    def _accept(self) -> None:
        with contextlib.suppress(OSError):  # the peer has gone again
            connection, _ = self._listener.accept()
            if len(self._peers) >= _MOST_PEERS:
                next(iter(self._peers.values())).close()
            self._peers[connection] = _Peer(self._loop, connection, self._answers, self._peers)


class _Peer:
    """One connection; it has at most one response on the way."""

    def __init__(
        self,
        loop: Loop,
        connection: socket.socket,
        answers: Answers,
        peers: dict[socket.socket, _Peer],
    ) -> None:
        connection.setblocking(False)
        self._loop = loop
        self._socket = connection
        self._answers = answers
        self._peers = peers
        self._line = b""
        self._unsent = memoryview(b"")
        loop.watch(connection, self._ready)

    def close(self) -> None:
        """Close it."""
        if self._peers.pop(self._socket, None) is not None:
            self._loop.forget(self._socket)
            self._socket.close()

    def _ready(self) -> None:
        try:
            if self._unsent:
                self._send()
            else:
                self._receive()
        except BlockingIOError:
            return
        except OSError:
            self.close()

    def _receive(self) -> None:
        data = self._socket.recv(_LONGEST_LINE)
        self._line += data
        line, end, rest = self._line.partition(b"\n")
        if not data or rest or len(self._line) > _LONGEST_LINE or (end and line not in self._answers):
            self.close()
        elif end:
            self._line = b""
            try:
                response = self._answers[line]()
            except Exception:  # a world that cannot be shown must not end a training
                log.exception("no response to a viewer's %s", line.decode())
                self.close()
                return
            self._unsent = memoryview(LENGTH.pack(len(response)) + response)
            self._send()

    def _send(self) -> None:
        sent = 0
        with contextlib.suppress(BlockingIOError):
            sent = self._socket.send(self._unsent)
        self._unsent = self._unsent[sent:]
        self._loop.watch(self._socket, self._ready, writing=bool(self._unsent))


def _listening(path: Path) -> socket.socket:
    """Return a listening socket; its path may be longer than the 107 bytes of a socket's address."""
    path.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        listener.setblocking(False)
        listener.bind(f"/proc/self/fd/{folder}/{path.name}")
        listener.listen(_BACKLOG)
    except OSError:
        listener.close()
        raise
    finally:
        os.close(folder)
    return listener
