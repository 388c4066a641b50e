"""The wire format of ROS 1: connection headers and length-prefixed frames, as bytes.

Pure: this module uses no socket, so the simulator and the trainer can share it.
Source: http://wiki.ros.org/ROS/TCPROS and http://wiki.ros.org/ROS/Connection%20Header
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping

LENGTH = struct.Struct("<I")

# This limit is much larger than any message of the interface. A larger length in a frame means that the
# stream is corrupt.
MAX_FRAME_BYTES = 64 * 1024 * 1024


class FramingError(ValueError):
    """The bytes are not a header or frame of TCPROS."""


def frame(payload: bytes) -> bytes:
    """Return `payload`, preceded by its little-endian 32-bit length."""
    return LENGTH.pack(len(payload)) + payload


def encode_header(fields: Mapping[str, str]) -> bytes:
    """Return `fields` as a connection header, preceded by its length."""
    return frame(b"".join(frame(f"{name}={value}".encode()) for name, value in fields.items()))


def decode_header(payload: bytes) -> dict[str, str]:
    """Return the fields of a connection header; `payload` is the header without its own length.

    Raises:
        FramingError: the length of a field points past the end, or a field has no `=`.
    """
    fields: dict[str, str] = {}
    at = 0
    while at < len(payload):
        start = at + LENGTH.size
        if start > len(payload):
            raise FramingError("the connection header ends in the middle of a length")
        at = start + int(LENGTH.unpack_from(payload, at)[0])
        name, equals, value = payload[start:at].decode(errors="replace").partition("=")
        if at > len(payload) or not equals:
            raise FramingError(f"the connection header has a bad field {name[:40]!r}")
        fields[name] = value
    return fields


class FrameReader:
    """Splits a stream of bytes into frames; a frame may arrive in several pieces.

    Args:
        most_bytes: the longest frame.
    """

    __slots__ = ("_buffer", "_most_bytes")

    def __init__(self, most_bytes: int = MAX_FRAME_BYTES) -> None:
        self._buffer = bytearray()
        self._most_bytes = most_bytes

    def feed(self, data: bytes) -> Iterable[bytes]:
        """Return the payload of every frame that `data` completes; iterate over the result only once.

        Raises:
            FramingError: a frame is longer than `most_bytes`; raised during the iteration.
        """
        begins_here = not self._buffer and len(data) >= LENGTH.size
        if begins_here and LENGTH.unpack_from(data)[0] == len(data) - LENGTH.size <= self._most_bytes:
            return (data[LENGTH.size :],)  # the usual case: the data is exactly one whole frame
        self._buffer += data
        return self._cut()

    def _cut(self) -> Iterator[bytes]:
        buffer = self._buffer
        while len(buffer) >= LENGTH.size:
            (length,) = LENGTH.unpack_from(buffer)
            if length > self._most_bytes:
                raise FramingError(f"a frame of {length} bytes, more than the limit of {self._most_bytes}")
            end = LENGTH.size + length
            if len(buffer) < end:
                return
            payload = bytes(buffer[LENGTH.size : end])
            del buffer[:end]
            yield payload
