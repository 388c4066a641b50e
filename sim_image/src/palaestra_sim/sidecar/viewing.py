"""Read a simulator's data for viewers: shapes, poses, camera pictures.

The simulator computes the data between two steps, so every request slows the training a little. So poses are
read at most 30 times a second, and all viewers share the same response. The sidecar does not check the
responses; viewers do.
"""

from __future__ import annotations

import contextlib
import os
import socket
import struct
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Final, Self

from palaestra_protocol.camera_picture import MOST_PICTURE_BYTES
from palaestra_protocol.control import VIEW_CAMERA, VIEW_SCENE, VIEW_STATE
from palaestra_protocol.scene import MOST_SCENE_BYTES, MOST_STATE_BYTES

_LENGTH: Final = struct.Struct(">I")
_STATE_S: Final = 1.0 / 30.0
_PICTURE_S: Final = 0.2
_SCENE_S: Final = 1.0  # longer than _STATE_S, because a scene may be large and seldom changes
_DEADLINE_S: Final = 2.0


class NothingToSee(Exception):
    """This simulator does not describe its world; the error text is for people."""


class SimulatorSilent(Exception):
    """The simulator does not run, or does not respond; the error text is for people."""


class Viewing:
    """Reads the scene, the newest state and the newest picture of one simulator; safe from any thread.

    Args:
        path: the socket on which the simulator listens.
        clock: returns seconds, from any origin.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._reason = ""
        self._link = _Link(path)
        self._scene = _Newest(VIEW_SCENE, MOST_SCENE_BYTES, _SCENE_S)
        self._state = _Newest(VIEW_STATE, MOST_STATE_BYTES, _STATE_S)
        self._camera = _Newest(VIEW_CAMERA, MOST_PICTURE_BYTES, _PICTURE_S)
        self._clock = clock
        self._lock = threading.Lock()

    @classmethod
    def without(cls, reason: str) -> Self:
        """Return an object whose methods raise NothingToSee with the text `reason`."""
        nothing = cls(Path())
        nothing._reason = reason
        return nothing

    def scene(self) -> bytes:
        """Return the scene of the world (`VisibleScene`) as JSON, at most a second old.

        Raises:
            NothingToSee, SimulatorSilent
        """
        return self._read(self._scene)

    def state(self) -> bytes:
        """Return the state of the world (`SceneState`) as JSON, at most a thirtieth of a second old.

        Raises:
            NothingToSee, SimulatorSilent
        """
        return self._read(self._state)

    def camera(self) -> bytes:
        """Return the newest picture of a camera as JSON, at most 0.2 s old; null if no picture was sent.

        Raises:
            NothingToSee, SimulatorSilent
        """
        return self._read(self._camera)

    def close(self) -> None:
        """Close the connection to the simulator; the next request opens a new one."""
        with self._lock:
            self._link.close()

    def _read(self, newest: _Newest) -> bytes:
        if self._reason:
            raise NothingToSee(self._reason)
        with self._lock:  # other threads wait here for the lock, and then return the same response
            now = self._clock()
            if now >= newest.due:
                newest.content = self._link.ask(newest.request, newest.most_bytes)
                newest.due = now + newest.period_s
            return newest.content


class _Newest:
    """The last response to a request, and the time at which the request may be sent again."""

    def __init__(self, request: bytes, most_bytes: int, period_s: float) -> None:
        self.request = request
        self.most_bytes = most_bytes
        self.period_s = period_s
        self.content = b""
        self.due = 0.0


class _Link:
    """A connection to the simulator's socket; a request opens it if it is not open."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._socket: socket.socket | None = None

    def ask(self, request: bytes, most_bytes: int) -> bytes:
        """Send a request to the simulator and return the response.

        Raises:
            SimulatorSilent: the simulator does not run, or does not respond in time.
        """
        fact = "the simulator does not run"
        for again in (True, False):
            try:
                return self._asked(request, most_bytes)
            except TimeoutError:
                fact = f"the simulator did not respond within {_DEADLINE_S:g} s"
            except (BrokenPipeError, ConnectionResetError, EOFError):
                fact = "the simulator could not describe its world; its log has the reason"
                if again:  # the connection may have belonged to a simulator that has ended
                    self.close()
                    continue
            except OSError:
                fact = "the simulator does not run"
            break
        self.close()
        raise SimulatorSilent(fact)

    def _asked(self, request: bytes, most_bytes: int) -> bytes:
        if self._socket is None:
            self._socket = _connected(self._path)
        deadline = time.monotonic() + _DEADLINE_S
        self._socket.settimeout(_DEADLINE_S)
        self._socket.sendall(request + b"\n")
        (length,) = _LENGTH.unpack(self._exactly(self._socket, _LENGTH.size, deadline))
        if length > most_bytes:
            raise EOFError
        return self._exactly(self._socket, length, deadline)

    def _exactly(self, connection: socket.socket, count: int, deadline: float) -> bytes:
        read = bytearray()
        while len(read) < count:
            connection.settimeout(max(1e-3, deadline - time.monotonic()))
            part = connection.recv(min(2**20, count - len(read)))
            if not part:
                raise EOFError
            read += part
        return bytes(read)

    def close(self) -> None:
        """Close the connection; the next request opens a new one."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None


def _connected(path: Path) -> socket.socket:
    """Return a connection to the socket at `path`.

    A socket's address has at most 107 bytes. To allow longer paths, the address is the file name below
    `/proc/self/fd/N`, where N is an open descriptor of the folder.
    """
    with contextlib.ExitStack() as failing:
        connection = failing.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
        connection.settimeout(_DEADLINE_S)
        folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            connection.connect(f"/proc/self/fd/{folder}/{path.name}")
        finally:
            os.close(folder)
        failing.pop_all()
        return connection
