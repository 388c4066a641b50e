"""Decode only the reading in a sensor's message.

Every topic of a sensor begins with a std_msgs/Header. Only the `frame_id` in the header varies in length, and
a device always sends the same `frame_id`.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from functools import cache
from typing import Any

# The numbers after the header, as codes of `struct`; the last number is the reading.
RANGE = "Bffff"  # sensor_msgs/Range: type, field of view, least, most
BOOL = "?"
INT8 = "b"
INT32 = "i"
FLOAT64 = "d"
POINT = "ddd"  # geometry_msgs/PointStamped: x, y, z

_FRAME_ID_LENGTH = struct.Struct("<I")
_FRAME_ID_AT = 12  # the offset after sequence number and stamp


class NumberReading:
    """Reads the last number in the messages of one device.

    Args:
        device: the device's name in errors.
        codes: `struct` codes of the numbers after the header.
    """

    __slots__ = ("_codes", "_device", "_frame_id_bytes", "_layout")

    def __init__(self, device: str, codes: str) -> None:
        self._device = device
        self._codes = codes
        self._frame_id_bytes = 0
        self._layout = _layout(0, codes)

    def __call__(self, message: bytes | memoryview) -> Any:
        """Return the reading.

        Raises:
            ValueError: the reading is not finite, or the message has a wrong length, so other bytes would be
                read as a number.
            struct.error: the message ends within its header.
        """
        layout = self._layout
        # The next lines repeat the usual case of `_numbers` without a call, because a step reads a dozen
        # messages.
        numbers = layout.unpack(message) if len(message) == layout.size else (-1,)
        if numbers[0] != self._frame_id_bytes:
            numbers = self._numbers(message)
        reading = numbers[-1]
        if not math.isfinite(reading):
            raise ValueError(f"{reading} from {self._device}")
        return reading

    def _numbers(self, message: bytes | memoryview) -> tuple[Any, ...]:
        """Return the length of the frame_id, and the numbers after the header."""
        if len(message) != self._layout.size:
            self._fit(message)
        numbers = self._layout.unpack(message)
        if numbers[0] != self._frame_id_bytes:
            raise ValueError(f"a frame_id of {numbers[0]} bytes instead of {self._frame_id_bytes}")
        return numbers

    def _fit(self, message: bytes | memoryview) -> None:
        """Set the layout for messages with another length of the frame_id."""
        (frame_id_bytes,) = _FRAME_ID_LENGTH.unpack_from(message, _FRAME_ID_AT)
        length = self._layout.size - self._frame_id_bytes + frame_id_bytes
        if len(message) != length:
            raise ValueError(f"a message of {len(message)} bytes instead of {length}")
        self._frame_id_bytes = frame_id_bytes
        self._layout = _layout(frame_id_bytes, self._codes)


class PickedReading(NumberReading):
    """Reads some of the numbers after the header of a message, as a tuple.

    Args:
        device: the device's name in errors.
        codes: `struct` codes of the numbers after the header.
        picked: the positions of the wanted numbers; 0 is the first number after the header.
    """

    __slots__ = ("_picked",)

    def __init__(self, device: str, codes: str, picked: Sequence[int]) -> None:
        super().__init__(device, codes)
        self._picked = tuple(place + 1 for place in picked)  # the length of the frame_id is at place 0

    def __call__(self, message: bytes | memoryview) -> tuple[float, ...]:
        """Return the wanted numbers.

        Raises:
            ValueError, struct.error: as `NumberReading`.
        """
        numbers = self._numbers(message)
        wanted = tuple(numbers[place] for place in self._picked)
        if not all(map(math.isfinite, wanted)):
            raise ValueError(f"{wanted} from {self._device}")
        return wanted


@cache
def _layout(frame_id_bytes: int, codes: str) -> struct.Struct:
    """Return the layout of a message: the length of its frame_id, then its numbers."""
    return struct.Struct(f"<{_FRAME_ID_AT}xI{frame_id_bytes}x{codes}")
