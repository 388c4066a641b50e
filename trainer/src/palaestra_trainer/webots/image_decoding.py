"""Read images and points in messages of sensors as NumPy arrays, without copying or decoding pixels.

An array is a read-only view of the bytes that the connection received. The array is valid until the next
step, because the next message is written into the same memory. The numbers of the array may be unaligned in
memory; a copy is aligned.

The head of a message is all bytes before the numbers. All messages of one device have the same head except
for sequence number and time. So a head is parsed once, and the heads of later messages are only compared with
the parsed head.
"""

from __future__ import annotations

import math
import struct
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Message = bytes | memoryview

_HEAD_AT: Final = 12  # offset after the sequence number and the stamp, which change in each message
_LENGTH: Final = struct.Struct("<I")
_SIZE: Final = struct.Struct("<II")  # height, width
_IMAGE: Final = struct.Struct("<BII")  # is_bigendian, step, bytes of data
_FIELD: Final = struct.Struct("<IBI")  # offset, datatype, count of a sensor_msgs/PointField
_CLOUD: Final = struct.Struct("<BIII")  # is_bigendian, point_step, row_step, bytes of data
_IS_DENSE_BYTES: Final = 1  # the only field after the points
_FLOAT32: Final = 7  # sensor_msgs/PointField
_FLOAT_BYTES: Final = 4


@dataclass(frozen=True, slots=True)
class _Layout:
    """The positions of the numbers in a message.

    Attributes:
        head: the bytes from the frame_id to the data, equal in all messages of this layout.
        data_at: the offset of the first number, in bytes.
        length: length of the whole message, in bytes.
        shape: shape of the array: height, width and, if there are several, channels; or points and 3.
        strides: strides of the array, in bytes.
    """

    head: bytes
    data_at: int
    length: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


class _Arrays(ABC):
    """Reads the arrays in the messages of one device.

    Args:
        device: the device's name in errors.
        dtype: NumPy type of an array's numbers.
    """

    __slots__ = ("_device", "_dtype", "_layout")

    def __init__(self, device: str, dtype: str) -> None:
        self._device = device
        self._dtype = np.dtype(dtype)
        self._layout: _Layout | None = None

    def __call__(self, message: Message) -> NDArray[Any]:
        """Return a read-only view of the array in the message.

        Raises:
            ValueError: the message has another format, a wrong length or an invalid number.
            struct.error: the message ends within its head.
        """
        layout = self._layout
        if layout is None or message[_HEAD_AT : _HEAD_AT + len(layout.head)] != layout.head:
            layout = self._layout = self._read_head(message)
        if len(message) != layout.length:
            raise ValueError(f"a message of {len(message)} bytes instead of {layout.length}")
        array: NDArray[Any] = np.ndarray(layout.shape, self._dtype, message, layout.data_at, layout.strides)
        array.flags.writeable = False
        return array

    @abstractmethod
    def _read_head(self, message: Message) -> _Layout:
        """Return the layout of a message."""


class ImageReading(_Arrays):
    """Reads sensor_msgs/Image in encoding bgra8: shape (height, width, 4), uint8."""

    __slots__ = ()
    encoding: str = "bgra8"
    channels: tuple[int, ...] = (4,)

    def __init__(self, device: str, dtype: str = "u1") -> None:
        super().__init__(device, dtype)

    def _read_head(self, message: Message) -> _Layout:
        at = _after_text(message, _HEAD_AT)
        height, width = _SIZE.unpack_from(message, at)
        encoding_at = at + _SIZE.size
        at = _after_text(message, encoding_at)
        encoding = bytes(message[encoding_at + _LENGTH.size : at]).decode("ascii", "replace")
        big_endian, step, data_bytes = _IMAGE.unpack_from(message, at)
        pixel_bytes = math.prod(self.channels) * self._dtype.itemsize
        if (encoding, big_endian) != (self.encoding, 0):
            order = "big" if big_endian else "little"
            raise ValueError(
                f"an image in {encoding}, {order}-endian, instead of {self.encoding}, little-endian"
            )
        if (step, data_bytes) != (width * pixel_bytes, height * width * pixel_bytes):
            raise ValueError(
                f"an image of {width} x {height} pixels with {step} bytes a row and {data_bytes} in all, not "
                f"{width * pixel_bytes} and {height * width * pixel_bytes}"
            )
        data_at = at + _IMAGE.size
        return _Layout(
            head=bytes(message[_HEAD_AT:data_at]),
            data_at=data_at,
            length=data_at + data_bytes,
            shape=(height, width, *self.channels),
            strides=(step, pixel_bytes, *(self._dtype.itemsize for _ in self.channels)),
        )


class RangesReading(ImageReading):
    """Reads sensor_msgs/Image in encoding 32FC1: shape (height, width), float32, infinite out of range."""

    __slots__ = ()
    encoding = "32FC1"
    channels = ()

    def __init__(self, device: str) -> None:
        super().__init__(device, "<f4")

    def __call__(self, message: Message) -> NDArray[Any]:
        """Return a read-only view of the distances in the message.

        Raises:
            ValueError: as for other images, or a distance is negative or NaN.
            struct.error: the message ends within its head.
        """
        ranges = super().__call__(message)
        if not (ranges >= 0.0).all():  # this form of the comparison refuses NaN too
            raise ValueError(f"a distance that is negative or NaN from {self._device}")
        return ranges


class PointsReading(_Arrays):
    """Reads sensor_msgs/PointCloud2 with float32 fields x, y, z: shape (points, 3), float32."""

    __slots__ = ()

    def __init__(self, device: str) -> None:
        super().__init__(device, "<f4")

    def _read_head(self, message: Message) -> _Layout:
        at = _after_text(message, _HEAD_AT)
        height, width = _SIZE.unpack_from(message, at)
        offsets, at = _point_fields(message, at + _SIZE.size)
        big_endian, point_step, _, data_bytes = _CLOUD.unpack_from(message, at)
        x_at = offsets.get("x", -1)
        if big_endian or [offsets.get(axis) for axis in "xyz"] != [
            x_at + _FLOAT_BYTES * it for it in range(3)
        ]:
            raise ValueError("a point cloud without float32 fields x, y, z in a row, little-endian")
        if not 0 <= x_at <= point_step - 3 * _FLOAT_BYTES or data_bytes != height * width * point_step:
            raise ValueError(
                f"a point cloud of {height * width} points with {point_step} bytes each"
                f" and {data_bytes} in all"
            )
        at += _CLOUD.size
        return _Layout(
            head=bytes(message[_HEAD_AT:at]),
            data_at=at + x_at,
            length=at + data_bytes + _IS_DENSE_BYTES,
            shape=(height * width, 3),
            strides=(point_step, _FLOAT_BYTES),
        )


def _after_text(message: Message, at: int) -> int:
    """Return the offset after the text at offset `at`; a text begins with its length."""
    (length,) = _LENGTH.unpack_from(message, at)
    return at + _LENGTH.size + int(length)


def _point_fields(message: Message, at: int) -> tuple[dict[str, int], int]:
    """Return the offsets of a point's float32 fields by name, and the offset after the list of fields."""
    (count,) = _LENGTH.unpack_from(message, at)
    at += _LENGTH.size
    offsets = {}
    for _ in range(count):
        name_at, at = at + _LENGTH.size, _after_text(message, at)
        name = bytes(message[name_at:at]).decode("ascii", "replace")
        offset, datatype, _ = _FIELD.unpack_from(message, at)
        at += _FIELD.size
        if datatype == _FLOAT32:
            offsets[name] = offset
    return offsets, at
