"""Read and write image files.

Writing a PNG file needs no library. Everything else needs Pillow, which is imported on demand. Paths are
absolute, or relative to the working directory of the simulator.
"""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any, Final

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene import png
from palaestra_sim.scene.image_buffer import ImageBuffer

_JPEG: Final = (".jpeg", ".jpg")
_MOST_PIXELS: Final = 4096 * 4096
Pixels = bytes | bytearray | memoryview


def save(
    path: str, size: tuple[int, int], pixels: Pixels, *, quality: int = 100, alpha: bool = False
) -> bool:
    """Write an image to a PNG or JPEG file; return whether it could be written.

    Args:
        path: the path of the file.
        size: width and height in pixels.
        pixels: blue, green, red and alpha of each pixel, row by row from the top left.
        quality: the quality of a JPEG file, from 1 to 100.
        alpha: whether a PNG file stores the alpha values.

    Raises:
        UnsimulatedError: the path does not have the suffix of a PNG or JPEG file, or Pillow is missing.
    """
    if not all(size):
        return False
    ending = Path(path).suffix.lower()
    if ending == ".png":
        data = png.encode(size, pixels, alpha=alpha)
    elif ending in _JPEG:
        data = jpeg(size, pixels, quality)
    else:
        raise UnsimulatedError(f"{path}: is not a PNG or JPEG file; use a name that ends in .png or .jpg")
    try:
        Path(path).write_bytes(data)
    except OSError:
        return False
    return True


def load(path: str) -> ImageBuffer | None:
    """Return the image of a PNG or JPEG file; None if it cannot be read.

    Raises:
        UnsimulatedError: Pillow is missing.
    """
    return _opened(path)


def _opened(file: str | BytesIO) -> ImageBuffer | None:
    images = pillow("Image")
    try:
        with images.open(file, formats=("PNG", "JPEG")) as image:
            width, height = image.size
            if width * height > _MOST_PIXELS:
                return None
            pixels = bytearray(image.convert("RGBA").tobytes("raw", "BGRA"))
    except (OSError, SyntaxError, ValueError, images.DecompressionBombError):
        return None
    return ImageBuffer(width=width, height=height, pixels=pixels)


def decode(data: bytes) -> ImageBuffer | None:
    """Return the image in the bytes of a PNG or JPEG file; None if the bytes are not such a file.

    Raises:
        UnsimulatedError: Pillow is missing.
    """
    return _opened(BytesIO(data))


def pillow(module: str) -> Any:
    """Return a module of Pillow.

    Raises:
        UnsimulatedError: Pillow is not installed.
    """
    try:
        return import_module(f"PIL.{module}")
    except ImportError as error:
        raise UnsimulatedError(
            f"texts, JPEG files and loaded pictures need Pillow: {error}; install palaestra-sim[pictures]"
        ) from error


def jpeg(size: tuple[int, int], pixels: Pixels, quality: int) -> bytes:
    """Return the bytes of a JPEG file; the arguments are those of `save`.

    Raises:
        UnsimulatedError: Pillow is missing.
    """
    image = pillow("Image").frombuffer("RGB", size, bytes(pixels), "raw", "BGRX", 0, 1)
    written = BytesIO()
    image.save(written, "JPEG", quality=max(1, min(100, quality)))
    return written.getvalue()
