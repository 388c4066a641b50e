"""Pictures as PNG files."""

import struct
import zlib

import pytest

from palaestra_sim.scene import png
from palaestra_sim.seam import UnsimulatedError

BLUE, RED = bytes((255, 0, 0, 255)), bytes((0, 0, 255, 255))


def decode(data):
    """Return the size and the rows of a PNG file without filters, as this project writes them."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        assert struct.unpack_from(">I", data, at + 8 + length)[0] == zlib.crc32(kind + body)
        chunks[kind], at = body, at + 12 + length
    width, height, bits, color = struct.unpack_from(">IIBB", chunks[b"IHDR"])
    assert (bits, color) == (8, 2)
    rows = zlib.decompress(chunks[b"IDAT"])
    step = 1 + 3 * width
    return (width, height), [rows[at + 1 : at + step] for at in range(0, len(rows), step)]


def test_a_picture_is_written_row_by_row_as_red_green_blue(tmp_path):
    """Its checksums hold, so that other programs read it."""
    path = tmp_path / "eye.PNG"

    assert png.save(str(path), (2, 2), memoryview(BLUE + RED + RED + BLUE))
    assert decode(path.read_bytes()) == ((2, 2), [b"\0\0\xff\xff\0\0", b"\xff\0\0\0\0\xff"])


def test_a_picture_that_cannot_be_written_is_a_failure(tmp_path):
    """The folder is missing."""
    assert not png.save(str(tmp_path / "none" / "eye.png"), (1, 1), BLUE)


def test_other_formats_are_refused(tmp_path):
    """A file of another format than its name says would be worse."""
    with pytest.raises(UnsimulatedError, match=r"only PNG files are written; use a name that ends in \.png"):
        png.save(str(tmp_path / "eye.jpg"), (1, 1), BLUE)
