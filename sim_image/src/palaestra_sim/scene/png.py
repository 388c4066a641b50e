"""Pictures as files: PNG, of 8 bits a channel, without a library.

Source: https://www.w3.org/TR/png/
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from palaestra_sim.seam import UnsimulatedError

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"
_RGB: Final = 2
_CHANNELS: Final = 4  # blue, green, red, alpha
_FAST: Final = 1  # of zlib: a picture of 640 x 480 takes 10 ms


def save(path: str, size: tuple[int, int], pixels: bytes | memoryview) -> bool:
    """Write a picture to a file; return whether it could be written.

    Args:
        path: of the file, absolute or below the working directory of the simulator.
        size: width and height.
        pixels: blue, green, red and alpha of each, row by row from the top left; alpha is not written.

    Raises:
        UnsimulatedError: the file would not be a PNG file.
    """
    if not path.lower().endswith(".png"):
        raise UnsimulatedError(f"{path}: only PNG files are written; use a name that ends in .png")
    try:
        Path(path).write_bytes(encode(size, pixels))
    except OSError:
        return False
    return True


def encode(size: tuple[int, int], pixels: bytes | memoryview) -> bytes:
    """Return the bytes of a PNG file of pixels as those of `save`."""
    width, height = size
    colors = bytearray(3 * width * height)
    for channel in range(3):
        colors[channel::3] = pixels[2 - channel :: _CHANNELS]
    header = struct.pack(">IIBBBBB", width, height, 8, _RGB, 0, 0, 0)
    rows = b"".join(_rows(colors, 3 * width))
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows, _FAST)), (b"IEND", b""))
    return _SIGNATURE + b"".join(_chunk(kind, data) for kind, data in chunks)


def _rows(colors: bytearray, length: int) -> Iterator[bytes]:
    """Yield each row behind the number of its filter; 0 is none."""
    for at in range(0, len(colors), length):
        yield b"\0"
        yield bytes(colors[at : at + length])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
