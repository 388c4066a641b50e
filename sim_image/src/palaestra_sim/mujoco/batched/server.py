"""The socket on which a trainer requests steps and resets of many copies of a world.

The server has one client at a time. A new connection replaces the old one, because a trainer that lost a
response connects again. Between requests, the simulator uses no processor time.
"""

from __future__ import annotations

import contextlib
import logging
import os
import select
import socket
import time
from pathlib import Path
from typing import Any, Final

import numpy as np

from palaestra_protocol.batch import (
    HEADER,
    BatchDescription,
    BatchRequest,
    FrameKind,
    frame,
    json_frame,
    kind_and_length,
    read_frame,
    request_of,
    reset_parts,
)
from palaestra_protocol.fields import ProtocolError
from palaestra_protocol.whole_file import write_whole
from palaestra_sim.errors import SimError
from palaestra_sim.mujoco.batched.world import BatchReadings, BatchWorld, Reset

FRAME_S: Final = 10.0  # time limit for reading a frame after its first byte, and for sending a response
_LOOPBACK: Final = "127.0.0.1"

log = logging.getLogger(__name__)


class Stopped(Exception):
    """`BatchServer.stop` was called, so `run` has to return."""


class BatchServer:
    """Serves one batched world until `stop`.

    Args:
        world: the world.
        rows: the number of copies.
        address_file: the file to which the address is written, as `host:port`; None: it is only logged.
    """

    def __init__(self, world: BatchWorld, rows: int, address_file: Path | None) -> None:
        self._world, self._rows = world, rows
        self._request: BatchRequest | None = None
        self._wake, self._woken = os.pipe()
        self._listener = socket.create_server((_LOOPBACK, 0))
        host, port = self._listener.getsockname()
        log.info("batch of %d rows at %s:%d", rows, host, port)
        if address_file is not None:
            write_whole(address_file, f"{host}:{port}\n".encode())

    def stop(self) -> None:
        """Make `run` return after the current request; a handler of a signal may call this method."""
        os.write(self._woken, b".")

    def run(self) -> None:
        """Serve requests until `stop`."""
        client: socket.socket | None = None
        try:
            while True:
                ready = self._ready(client)
                if self._listener in ready:
                    client = self._replaced(client)
                elif client is not None and not self._serve(client):
                    client.close()
                    client = None
        except Stopped:
            log.info("ends")
        finally:
            self._listener.close()
            if client is not None:
                client.close()

    def _ready(self, client: socket.socket | None) -> list[Any]:
        watched: list[Any] = [self._wake, self._listener, *([] if client is None else [client])]
        ready, _, _ = select.select(watched, [], [])
        if self._wake in ready:
            raise Stopped
        return ready

    def _replaced(self, client: socket.socket | None) -> socket.socket:
        if client is not None:
            client.close()
        self._request = None
        fresh, _ = self._listener.accept()
        fresh.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        fresh.settimeout(FRAME_S)
        return fresh

    def _serve(self, client: socket.socket) -> bool:
        """Respond to one request; return whether the connection can be used further."""
        try:
            kind, content = _received(client)
            try:
                answer = self._answer(kind, content)
            except SimError as error:
                answer = frame(FrameKind.REFUSED, str(error).encode())
            client.sendall(answer)
        except ProtocolError as error:
            log.warning("connection closed: %s", error)
            with contextlib.suppress(OSError):
                client.sendall(frame(FrameKind.REFUSED, str(error).encode()))
        except (EOFError, OSError):
            pass  # the trainer closed the connection, or does not read
        else:
            return True
        return False

    def _answer(self, kind: FrameKind, content: bytes) -> bytes:
        if kind is FrameKind.OPEN:
            self._request = None
            request = request_of(content)
            description: BatchDescription = self._world.open(request)
            self._request = request
            return json_frame(FrameKind.OPENED, description)
        if self._request is None:
            raise ProtocolError("a step or reset before OPEN")
        if kind is FrameKind.STEP:
            commands = np.frombuffer(content, "<f8")
            if commands.size != self._rows * len(self._request.motors):
                raise ProtocolError(f"{commands.size} commands do not fit {self._rows} rows")
            return _read(self._world.step(commands.reshape(self._rows, -1)))
        if kind is FrameKind.RESET:
            return _read(self._world.reset(self._reset(content, self._request)))
        raise ProtocolError(f"{kind.name} is not a request")

    def _reset(self, content: bytes, request: BatchRequest) -> Reset:
        parts = reset_parts(
            memoryview(content),
            robot=bool(request.robot),
            joints=len(request.joints),
            motors=len(request.motors),
        )
        rows = np.frombuffer(parts.rows, "<u4").astype(np.int32)
        if not rows.size or (np.diff(rows) <= 0).any() or rows[0] < 0 or rows[-1] >= self._rows:
            raise ProtocolError(f"the rows of a reset must increase, from 0 to {self._rows - 1}")
        numbers = [np.frombuffer(part, "<f8").reshape(len(rows), -1) for part in parts[2:]]
        if not all(np.isfinite(part).all() for part in numbers[:2]):
            raise ProtocolError("a place or joint position of a reset is not finite")
        seeds = np.frombuffer(parts.seeds, "<i8")
        return Reset(rows=rows, seeds=seeds, places=numbers[0], joints=numbers[1], commands=numbers[2])


def _read(readings: BatchReadings) -> bytes:
    failed = readings.failed[:, None]  # the numbers of a failed row are meaningless, so zeros are sent
    values = np.where(failed, 0.0, readings.values).astype("<f8").tobytes()
    poses = np.where(failed, 0.0, readings.poses).astype("<f8").tobytes()
    return read_frame(values, poses, readings.failed.astype(np.uint8).tobytes(), readings.reasons)


def _received(client: socket.socket) -> tuple[FrameKind, bytes]:
    """Return the kind and content of the next frame.

    Raises:
        EOFError, OSError: the connection ended, or the frame did not come in time.
        ProtocolError: the bytes are not a frame.
    """
    give_up = time.monotonic() + FRAME_S
    kind, length = kind_and_length(_exactly(client, HEADER.size, give_up))
    return kind, _exactly(client, length, give_up)


def _exactly(client: socket.socket, count: int, give_up: float) -> bytes:
    read = bytearray(count)
    view, got = memoryview(read), 0
    while got < count:
        client.settimeout(max(1e-3, give_up - time.monotonic()))
        some = client.recv_into(view[got:])
        if not some:
            raise EOFError
        got += some
    return bytes(read)
