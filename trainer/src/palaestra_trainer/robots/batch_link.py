"""A client of the socket on which a simulator serves copies of its world: one request, one response.

`palaestra_protocol.batch` defines the messages. Every wait has a deadline. A response that is late or
violates the protocol is a fault of the simulator, and the connection is closed.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.batch import (
    HEADER,
    BatchDescription,
    BatchRequest,
    FrameKind,
    ResetParts,
    description_of,
    frame,
    json_frame,
    kind_and_length,
    read_parts,
    reset_frame,
)
from palaestra_protocol.fields import ProtocolError
from palaestra_trainer.errors import SimulatorDead, SimulatorHung, WorldMisfit, WrongData

ANSWER_S: Final = 30.0  # the longest time for a response to a step or reset
_OPENING_S: Final = 60.0  # the simulator takes a few steps before it responds
_LONGEST_TEXT: Final = 2000

Floats = NDArray[np.float64]


class BatchReading(NamedTuple):
    """The readings of some rows: values (rows, values), poses (rows, 3), failed (rows,), reasons by row."""

    values: Floats
    poses: Floats
    failed: NDArray[np.bool_]
    reasons: Mapping[int, str]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BatchReset:
    """A reset of rows; see `palaestra_protocol.batch.reset_frame`.

    Attributes:
        rows: the numbers of the rows, which increase.
        seeds: the seed of each row.
        places: x, y and quaternion of each row's robot (rows, 6), or an empty array.
        joints: the positions of the joints (rows, joints).
        commands: the commands after the reset (rows, motors).
    """

    rows: NDArray[np.int64]
    seeds: NDArray[np.int64]
    places: Floats
    joints: Floats
    commands: Floats


class BatchLink:
    """The connection to one simulator with copies of its world.

    Args:
        name: the name of the simulator, in errors.
        answer_s: the longest time for a response to a step or reset.

    Attributes:
        description: the simulator's description of its copies and devices; None before `open`.
    """

    def __init__(self, name: str, answer_s: float = ANSWER_S) -> None:
        self.name = name
        self.description: BatchDescription | None = None
        self._answer_s = answer_s
        self._socket: socket.socket | None = None
        self._rows = self._values = 0

    def open(self, address: str, request: BatchRequest) -> BatchDescription:
        """Connect to `host:port` and request these devices; return the simulator's description of them.

        Raises:
            WorldMisfit: the world lacks a device or node, or cannot be simulated in this way.
            SimulatorDead, SimulatorHung, WrongData
        """
        self.close()
        host, _, port = address.rpartition(":")
        with self._faults():
            self._socket = socket.create_connection((host, int(port)), timeout=_OPENING_S)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            content = self._asked(json_frame(FrameKind.OPEN, request), FrameKind.OPENED, _OPENING_S)
            self.description = description_of(bytes(content))
        self._rows, self._values = self.description.rows, len(request.sensors)
        return self.description

    def step(self, commands: Floats) -> BatchReading:
        """Step all rows with these commands (rows, motors); return the readings of all rows.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """
        content = np.ascontiguousarray(commands, "<f8").tobytes()
        return self._read(frame(FrameKind.STEP, content), self._rows)

    def reset(self, reset: BatchReset) -> BatchReading:
        """Reset rows; return the readings of these rows.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """
        parts = ResetParts(
            rows=memoryview(reset.rows.astype("<u4").tobytes()),
            seeds=memoryview(reset.seeds.astype("<i8").tobytes()),
            places=memoryview(reset.places.astype("<f8").tobytes()),
            joints=memoryview(reset.joints.astype("<f8").tobytes()),
            commands=memoryview(reset.commands.astype("<f8").tobytes()),
        )
        return self._read(reset_frame(len(reset.rows), parts), len(reset.rows))

    def close(self) -> None:
        """Close the connection; further calls have no effect."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _read(self, request: bytes, rows: int) -> BatchReading:
        with self._faults():
            content = self._asked(request, FrameKind.READ, self._answer_s)
            parts = read_parts(content, rows=rows, values=self._values)
        return BatchReading(
            np.frombuffer(parts.values, "<f8").reshape(rows, self._values),
            np.frombuffer(parts.poses, "<f8").reshape(rows, 3),
            np.frombuffer(parts.failed, np.uint8) != 0,
            parts.reasons,
        )

    def _asked(self, request: bytes, wanted: FrameKind, deadline_s: float) -> memoryview:
        """Return the content of the response; the simulator must send it within `deadline_s` seconds."""
        if self._socket is None:
            raise SimulatorDead(self.name, "its connection for steps is closed")
        give_up = time.monotonic() + deadline_s
        self._socket.settimeout(deadline_s)
        self._socket.sendall(request)
        kind, length = kind_and_length(self._exactly(self._socket, HEADER.size, give_up))
        content = self._exactly(self._socket, length, give_up)
        if kind is FrameKind.REFUSED:
            raise WorldMisfit(self.name, bytes(content[:_LONGEST_TEXT]).decode(errors="replace"))
        if kind is not wanted:
            raise ProtocolError(f"{kind.name} is not the response to the request")
        return content

    @staticmethod
    def _exactly(connection: socket.socket, count: int, give_up: float) -> memoryview:
        content = memoryview(bytearray(count))
        got = 0
        while got < count:
            connection.settimeout(max(1e-3, give_up - time.monotonic()))
            some = connection.recv_into(content[got:])
            if not some:
                raise ConnectionResetError("it closed the connection")
            got += some
        return content

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        """Raise the errors of a connection as faults of the simulator, and close the connection."""
        try:
            yield
        except TimeoutError as error:
            self.close()
            raise SimulatorHung(self.name, "does not respond to a step of its copies") from error
        except (ProtocolError, struct.error, ValueError) as error:
            self.close()
            raise WrongData(self.name, f"sent an invalid response: {error}") from error
        except OSError as error:
            self.close()
            raise SimulatorDead(self.name, f"its connection for steps ended ({error})") from error
