"""Saving camera images to files, and loading them."""

import struct
import sys
import zlib

import pytest

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene import picture_files
from palaestra_sim.scene.image_buffer import ImageBuffer

BLUE, RED = bytes((255, 0, 0, 255)), bytes((0, 0, 255, 255))


def decode(data):
    """Return the size and the rows of a PNG file that this project has written, so without filters."""
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
    """The image is red, blue / blue, red, so a wrong order of rows or channels is visible."""
    path = tmp_path / "eye.PNG"

    assert picture_files.save(str(path), (2, 2), memoryview(BLUE + RED + RED + BLUE))
    assert decode(path.read_bytes()) == ((2, 2), [b"\0\0\xff\xff\0\0", b"\xff\0\0\0\0\xff"])


def test_a_picture_is_loaded_as_it_was_saved(tmp_path):
    """A loaded image must look like the saved one; with `alpha=True` this includes the transparency."""
    path, pixels = str(tmp_path / "eye.png"), BLUE + bytes((1, 2, 3, 4))

    assert picture_files.save(path, (2, 1), pixels, alpha=True)
    assert picture_files.load(path) == ImageBuffer(width=2, height=1, pixels=bytearray(pixels))


def test_a_jpeg_file_has_the_quality_that_was_asked_for(tmp_path):
    """A lower quality gives a smaller file; the loaded colors are close to the saved ones."""
    path, pixels = tmp_path / "eye.jpg", bytes(range(256)) * 64
    assert picture_files.save(str(path), (64, 64), pixels, quality=100)
    best = path.stat().st_size
    assert picture_files.save(str(path), (64, 64), pixels, quality=5)

    assert path.stat().st_size < best
    assert picture_files.save(str(path), (8, 8), RED * 64)
    blue, green, red, alpha = picture_files.load(str(path)).at(4, 4)
    assert (blue < 5, green < 5, red > 250, alpha) == (True, True, True, 255)


@pytest.mark.parametrize("data", [None, b"", b"GIF89a", b"\x89PNG\r\n\x1a\n broken"])
def test_what_is_no_picture_is_not_loaded(tmp_path, data):
    """Webots only prints an error about such a file, so the result is None and not an exception."""
    path = tmp_path / "logo.png"
    if data is not None:
        path.write_bytes(data)

    assert picture_files.load(str(path)) is None


def test_a_picture_that_cannot_be_written_is_a_failure(tmp_path):
    """A client must see that no file was written: the folder is missing, or the image has no pixel."""
    assert not picture_files.save(str(tmp_path / "none" / "eye.png"), (1, 1), BLUE)
    assert not picture_files.save(str(tmp_path / "eye.png"), (0, 0), b"")


def test_other_formats_are_refused(tmp_path):
    """Writing PNG data into a `.gif` file would mislead every reader of the file."""
    with pytest.raises(UnsimulatedError, match=r"use a name that ends in \.png or \.jpg"):
        picture_files.save(str(tmp_path / "eye.gif"), (1, 1), BLUE)


def test_without_pillow_the_refusal_names_what_to_install(tmp_path, monkeypatch):
    """PNG files do not need Pillow, but JPEG files do."""
    monkeypatch.setitem(sys.modules, "PIL.Image", None)

    assert picture_files.save(str(tmp_path / "eye.png"), (1, 1), BLUE)
    with pytest.raises(UnsimulatedError, match=r"install palaestra-sim\[pictures\]"):
        picture_files.save(str(tmp_path / "eye.jpg"), (1, 1), BLUE)
