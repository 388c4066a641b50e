"""A persistent TCPROS connection of a client, with a deadline for every wait.

The kernel enforces the deadlines (SO_RCVTIMEO), so a read needs only one system call. A selector or Python's
own timeout would need two system calls.
"""

from __future__ import annotations

import os
import select
import socket
import struct
import time
from collections.abc import Mapping

from palaestra_protocol.ros import sockets
from palaestra_protocol.ros.tcpros import LENGTH, MAX_FRAME_BYTES, FramingError, decode_header, encode_header
from palaestra_trainer.errors import SimulatorDead, SimulatorFault, SimulatorHung, WrongData
from palaestra_trainer.waiting import shutdown_deadline
from palaestra_trainer.waiting.wait_time import count_wait

_TIMEVAL = struct.Struct("@ll")
_BUFFER_BYTES = 8192
_MOST_KEPT_BYTES = 4 << 20  # an image arrives at each step, so a buffer of its size is kept

# A wake-up costs 30 us on a virtual machine, more than the stub needs for its response. So if the last wait
# was short, the next wait first polls a few times, and yields the processor between the polls.
_QUICK_S = 200e-6
_LOOKS = 30

# The flag is stored as a plain number. A step reads a dozen messages, and each use of the enum in `socket`
# would need two more lookups.
_NOW = int(socket.MSG_DONTWAIT)
_FIRST_BYTES = sockets.FIRST_BYTES
_LENGTH_BYTES = LENGTH.size


class TcprosClient:
    """A connection; the constructor does the handshake.

    Args:
        address: host and port of the peer.
        header: the connection header to send, e.g. service, md5sum and callerid.
        simulator: the simulator's name in faults.
        deadline_s: the longest time to wait for the peer.

    Raises:
        SimulatorDead: the connection was refused or closed.
        SimulatorHung: the handshake did not end in time.
        WrongData: the peer refused the header, or sent an invalid header.
    """

    __slots__ = ("_buffer", "_deadline_s", "_filled", "_quick", "_simulator", "_socket", "_view")

    def __init__(
        self, address: tuple[str, int], header: Mapping[str, str], simulator: str, deadline_s: float
    ) -> None:
        self._simulator = simulator
        self._deadline_s = deadline_s
        self._buffer = bytearray(_BUFFER_BYTES)
        self._view = memoryview(self._buffer)
        self._filled = 0
        self._quick = False
        try:
            self._socket = socket.create_connection(address, timeout=deadline_s)
        except OSError as error:
            raise self._fault("cannot be reached", error) from error
        self._socket.settimeout(None)
        for option in sockets.OPTIONS:
            self._socket.setsockopt(*option)
        self.wait_at_most(deadline_s)
        try:
            self.send(encode_header(header))
            self._check(bytes(self.receive()))
        except SimulatorFault:
            self.close()
            raise

    def wait_at_most(self, deadline_s: float) -> None:
        """Wait at most `deadline_s` for the peer from now on, in each call."""
        self._deadline_s = deadline_s
        timeval = _TIMEVAL.pack(int(deadline_s), int(deadline_s % 1 * 1e6))
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, timeval)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDTIMEO, timeval)

    def send(self, data: bytes) -> None:
        """Send all of `data`.

        Raises:
            SimulatorDead, SimulatorHung: see the class.
        """
        try:
            self._socket.sendall(data)
        except OSError as error:
            raise self._fault("does not accept requests", error) from error

    def await_end(self, deadline_s: float) -> bool:
        """Wait until the peer closes the connection, and return whether it did within the deadline.

        No response may be pending.
        """
        readable = select.poll()
        readable.register(self._socket, select.POLLIN)
        return bool(readable.poll(max(deadline_s, 0.0) * 1000.0))

    def receive(self, ahead: int = 0) -> bytes | memoryview:
        """Return the next frame, including `ahead` bytes before its length; valid until the next call.

        Raises:
            SimulatorDead, SimulatorHung: see the class.
            WrongData: the announced length is impossible.
        """
        if self._quick and not self._filled:
            # Usually exactly one whole frame has arrived. `recv` then reuses a small block of memory that is
            # still in the processor's cache. A buffer per connection would not be in the cache.
            try:
                data = self._socket.recv(_FIRST_BYTES, _NOW)
            except OSError:
                return self._receive_in_parts(ahead)
            begin = ahead + _LENGTH_BYTES
            if len(data) >= begin and LENGTH.unpack_from(data, ahead)[0] == len(data) - begin:
                return data if ahead else data[begin:]
            self._filled = len(data)
            self._view[: self._filled] = data
        return self._receive_in_parts(ahead)

    def _receive_in_parts(self, ahead: int) -> memoryview:
        give_up = 0.0
        while True:
            end = self._frame_end(ahead)
            if end and self._filled >= end:
                return self._take(ahead, end)
            self._make_room(end)
            if give_up and time.monotonic() > give_up:
                raise SimulatorHung(
                    self._simulator,
                    f"sent only part of a response; the rest did not arrive within {self._deadline_s:g} s",
                )
            self._read_more()
            give_up = give_up or time.monotonic() + self._deadline_s

    def acknowledge_late(self) -> None:
        """Let the kernel acknowledge two messages with one packet.

        An acknowledgment for each message takes half as long as reading the message. Use this method only for
        a peer with TCP_NODELAY: other peers wait for each acknowledgment before the next message.
        """
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 0)

    def waiting_bytes(self) -> bool:
        """Return whether unread bytes have arrived, or the connection is closed."""
        if self._filled:
            return True
        try:
            self._socket.recv(1, socket.MSG_PEEK | _NOW)
        except BlockingIOError:
            return False
        except OSError:
            return True
        return True

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self._socket.fileno()

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _frame_end(self, ahead: int) -> int:
        """Return the position after the first frame in the buffer; 0 while its length is unknown."""
        if self._filled < ahead + LENGTH.size:
            return 0
        (length,) = LENGTH.unpack_from(self._buffer, ahead)
        if length > MAX_FRAME_BYTES:
            raise WrongData(
                self._simulator,
                f"announced a frame of {length} bytes, more than the limit of {MAX_FRAME_BYTES}",
            )
        return ahead + LENGTH.size + int(length)

    def _take(self, ahead: int, end: int) -> memoryview:
        if self._filled == end <= _MOST_KEPT_BYTES:
            self._filled = 0
            return self._view[:end] if ahead else self._view[LENGTH.size : end]
        frame = memoryview(bytes(self._view[:end]))
        rest = bytes(self._view[end : self._filled])
        if end > _MOST_KEPT_BYTES:
            self._buffer = bytearray(_BUFFER_BYTES + len(rest))
            self._view = memoryview(self._buffer)
        self._view[: len(rest)] = rest
        self._filled = len(rest)
        return frame if ahead else frame[LENGTH.size :]

    def _make_room(self, end: int) -> None:
        """Enlarge a full buffer, but at most to twice its size, because the announced length may be wrong."""
        if self._filled == len(self._buffer):
            larger = bytearray(min(2 * self._filled, end + _BUFFER_BYTES))
            larger[: self._filled] = self._view
            self._buffer, self._view = larger, memoryview(larger)

    def _read_more(self) -> None:
        room = self._view[self._filled :]
        began = time.perf_counter()
        try:
            count = self._spin(room) if self._quick else None
            if count is None:
                count = self._sleep(room)
        except OSError as error:
            raise self._fault("does not respond", error) from error
        finally:
            count_wait(time.perf_counter() - began)
        if count == 0:
            raise SimulatorDead(self._simulator, "closed the connection")
        self._filled += count

    def _spin(self, room: memoryview) -> int | None:
        """Return the number of bytes that arrived during polling; None if no bytes arrived."""
        for _ in range(_LOOKS):
            try:
                return self._socket.recv_into(room, 0, _NOW)
            except BlockingIOError:
                os.sched_yield()
        return None

    def _sleep(self, room: memoryview) -> int:
        """Return the number of bytes that arrived during a wait in the kernel."""
        began = time.perf_counter()
        count = self._socket.recv_into(room, 0, _NOW if shutdown_deadline.is_over() else 0)
        self._quick = time.perf_counter() - began < _QUICK_S
        return count

    def _fault(self, fact: str, error: OSError) -> SimulatorFault:
        if isinstance(error, BlockingIOError | TimeoutError):
            return SimulatorHung(self._simulator, f"{fact} within {self._deadline_s:g} s")
        return SimulatorDead(self._simulator, f"{fact}: {error.strerror or error}")

    def _check(self, payload: bytes) -> None:
        try:
            error = decode_header(payload).get("error")
        except FramingError as wrong:
            raise WrongData(self._simulator, str(wrong)) from wrong
        if error is not None:
            raise WrongData(self._simulator, f"refused the connection: {error}")
