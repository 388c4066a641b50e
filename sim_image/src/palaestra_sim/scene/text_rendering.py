"""Text as pixels, in Pillow's built-in font."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from palaestra_sim.scene.image_buffer import Point
from palaestra_sim.scene.picture_files import pillow


class Font(NamedTuple):
    """The style of a text: the height of its letters in pixels, and whether their edges are smooth."""

    size: int = 8
    smooth: bool = True


def letters(text: str, corner: Point, font: Font, size: tuple[int, int]) -> Iterator[tuple[Point, int]]:
    """Yield the pixels of a text, each with its coverage, from 1 to 255.

    Args:
        text: a text of one or more lines.
        corner: column and row of the pixel at the upper left corner of the first letter.
        font: the font of all letters.
        size: width and height of the image in pixels; pixels outside it are not yielded.

    Raises:
        UnsimulatedError: Pillow is missing.
    """
    mask = pillow("Image").new("L", size)
    brush = pillow("ImageDraw").Draw(mask)
    brush.fontmode = "L" if font.smooth else "1"
    shapes = pillow("ImageFont").load_default(font.size)
    line_height = sum(shapes.getmetrics())
    for number, line in enumerate(text.split("\n")):
        brush.text((corner[0], corner[1] + number * line_height), line, fill=255, font=shapes)
    for at, share in enumerate(mask.tobytes()):
        if share:
            row, column = divmod(at, size[0])
            yield (column, row), share
