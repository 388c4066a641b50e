"""A Unix socket on which a sidecar requests the data for viewers: shapes, poses, camera pictures.

A request is one line. A response is the number of its bytes, as a big-endian 32-bit integer, and then these
bytes. The event loop handles requests between two steps, one at a time. Without requests the simulator
computes no data for viewers. The socket is a file, so only processes with access to its folder can use it.
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
        loop: the event loop that accepts and serves connections.
        path: the path of the socket; an existing file is replaced.
        answers: for each request line, the function that returns the response.

    Raises:
        OSError: the socket cannot be created at `path`.
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
        with contextlib.suppress(OSError):  # the peer has closed the connection already
            connection, _ = self._listener.accept()
            if len(self._peers) >= _MOST_PEERS:
                next(iter(self._peers.values())).close()
            self._peers[connection] = _Peer(self._loop, connection, self._answers, self._peers)


class _Peer:
    """One connection of a sidecar; the next request is read after the last response was sent."""

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
        """Close the connection."""
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
            except Exception:  # an error in the data for viewers must not end the simulator
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
    """Return a listening socket at `path`.

    A socket's address has at most 107 bytes. To allow longer paths, the address is the file name below
    `/proc/self/fd/N`, where N is an open descriptor of the folder.
    """
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
