"""Encode images as PNG with 8 bits per channel, without a library.

Source: https://www.w3.org/TR/png/
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Final

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
_RGB, _RGBA = 2, 6
_CHANNELS: Final = 4  # blue, green, red, alpha
_FAST: Final = 1  # the compression level for zlib; an image of 640 x 480 pixels takes 10 ms


def encode(size: tuple[int, int], pixels: bytes | bytearray | memoryview, *, alpha: bool = False) -> bytes:
    """Return the bytes of a PNG file.

    Args:
        size: width and height in pixels.
        pixels: blue, green, red and alpha of each pixel, row by row from the top left.
        alpha: whether the file stores the alpha values.
    """
    width, height = size
    order = (2, 1, 0, 3) if alpha else (2, 1, 0)
    colors = bytearray(len(order) * width * height)
    for channel, place in enumerate(order):
        colors[channel :: len(order)] = pixels[place::_CHANNELS]
    header = struct.pack(">IIBBBBB", width, height, 8, _RGBA if alpha else _RGB, 0, 0, 0)
    rows = b"".join(_rows(colors, len(order) * width))
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, _FAST)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, data) for kind, data in chunks)


def _rows(colors: bytearray, length: int) -> Iterator[bytes]:
    """Yield the number of a filter (0 for no filter) and the pixels, for each row."""
    for at in range(0, len(colors), length):
        yield b"\0"
        yield bytes(colors[at : at + length])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
