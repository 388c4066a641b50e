"""An image of pixels, and functions that draw lines, ovals and polygons on it. Pure.

Rows go from the top down, and pixels go from left to right. Points outside the image are not drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

Color = tuple[int, int, int, int]  # blue, green, red, alpha: the order of Webots' images
Point = tuple[int, int]

_BYTES = 4
OPAQUE = 255
BLACK = (0, 0, 0, OPAQUE)


@dataclass(slots=True, kw_only=True)
class ImageBuffer:
    """An image of `width` by `height` pixels, transparent black at first; `pixels` has the colors by row."""

    width: int
    height: int
    pixels: bytearray = field(default_factory=bytearray)

    def __post_init__(self) -> None:
        """Create transparent black pixels if `pixels` is empty."""
        if not self.pixels:
            self.pixels = bytearray(_BYTES * self.width * self.height)

    def at(self, x: int, y: int) -> Color:
        """Return the color of a pixel inside the image."""
        start = _BYTES * (y * self.width + x)
        blue, green, red, alpha = self.pixels[start : start + _BYTES]
        return blue, green, red, alpha

    def draw(self, points: Iterable[Point], color: Color, opacity: int = OPAQUE) -> None:
        """Draw pixels in a color, mixed with their existing color by the opacity, from 0 to 255."""
        for x, y in points:
            if 0 <= x < self.width and 0 <= y < self.height:
                start = _BYTES * (y * self.width + x)
                self.pixels[start : start + _BYTES] = bytes(_mixed(self.at(x, y), color, opacity))

    def exchange(self, old: Color, new: Color) -> None:
        """Replace one color by another in all pixels."""
        for start in range(0, len(self.pixels), _BYTES):
            if tuple(self.pixels[start : start + _BYTES]) == old:
                self.pixels[start : start + _BYTES] = bytes(new)

    def copy(self, x: int, y: int, width: int, height: int) -> ImageBuffer:
        """Return the part of the image inside a rectangle; the part may be smaller, or have no pixels."""
        left, top = max(0, x), max(0, y)
        right, bottom = min(self.width, x + width), min(self.height, y + height)
        rows = (
            self.pixels[_BYTES * (row * self.width + left) : _BYTES * (row * self.width + right)]
            for row in range(top, bottom)
            if left < right
        )
        size = (right - left, bottom - top) if left < right and top < bottom else (0, 0)
        return ImageBuffer(width=size[0], height=size[1], pixels=bytearray().join(rows))

    def paste(self, other: ImageBuffer, x: int, y: int, *, blend: bool = False) -> None:
        """Paste another image over this image; with `blend`, mix the colors by the other image's alpha."""
        for row in range(other.height):
            for column in range(other.width):
                color = other.at(column, row)
                inside = 0 <= x + column < self.width and 0 <= y + row < self.height
                if blend and inside:
                    old = self.at(x + column, y + row)
                    blue, green, red, _ = _mixed(old, color, color[3])
                    color = blue, green, red, min(OPAQUE, old[3] + color[3])
                self.draw([(x + column, y + row)], color)


def on_background(picture: ImageBuffer, background: bytes | bytearray | memoryview) -> ImageBuffer:
    """Return an opaque image: `picture` on a background of the same size, mixed by the alpha of `picture`."""
    behind = ImageBuffer(width=picture.width, height=picture.height, pixels=bytearray(background))
    for y in range(picture.height):
        for x in range(picture.width):
            color = picture.at(x, y)
            blue, green, red, _ = _mixed(behind.at(x, y), color, color[3])
            behind.draw([(x, y)], (blue, green, red, OPAQUE))
    return behind


def _mixed(old: Color, new: Color, opacity: int) -> Color:
    """Return a mix of two colors, in integer arithmetic like Webots."""
    rest = OPAQUE - opacity
    blue, green, red, alpha = ((rest * a + opacity * b) // OPAQUE for a, b in zip(old, new, strict=True))
    return blue, green, red, alpha


def line(x1: int, y1: int, x2: int, y2: int) -> Iterator[Point]:
    """Yield the pixels of a line, ends included."""
    count = max(abs(x2 - x1), abs(y2 - y1))
    for index in range(count + 1):
        share = index / count if count else 0.0
        yield round(x1 + share * (x2 - x1)), round(y1 + share * (y2 - y1))


def rectangle(x: int, y: int, width: int, height: int) -> Iterator[Point]:
    """Yield the pixels of the outline of a rectangle."""
    right, bottom = x + width - 1, y + height - 1
    yield from outline([(x, y), (right, y), (right, bottom), (x, bottom)])


def filled_rectangle(x: int, y: int, width: int, height: int) -> Iterator[Point]:
    """Yield all pixels of a rectangle."""
    return ((column, row) for row in range(y, y + height) for column in range(x, x + width))


def oval(cx: int, cy: int, a: int, b: int) -> Iterator[Point]:
    """Yield the pixels of an ellipse around a center, with the half axes `a` and `b`."""
    steps = max(8, 8 * max(a, b))
    turns = (2.0 * math.pi * step / steps for step in range(steps))
    return ((round(cx + a * math.cos(turn)), round(cy + b * math.sin(turn))) for turn in turns)


def filled_oval(cx: int, cy: int, a: int, b: int) -> Iterator[Point]:
    """Yield all pixels of an ellipse."""
    for row in range(-b, b + 1):
        half = round(a * math.sqrt(max(0.0, 1.0 - (row / b) ** 2))) if b else a
        yield from ((cx + column, cy + row) for column in range(-half, half + 1))


def outline(corners: Sequence[Point]) -> Iterator[Point]:
    """Yield the pixels of the sides of a polygon."""
    for start, end in zip(corners, [*corners[1:], *corners[:1]], strict=True):
        yield from line(*start, *end)


def filled_polygon(corners: Sequence[Point]) -> Iterator[Point]:
    """Yield all pixels of a polygon: those of its sides, and those inside by the even-odd rule."""
    yield from outline(corners)
    rows = [y for _, y in corners]
    sides = list(zip(corners, [*corners[1:], *corners[:1]], strict=True))
    for y in range(min(rows, default=0), max(rows, default=-1) + 1):
        crossings = sorted(
            x1 + (y - y1) * (x2 - x1) / (y2 - y1)
            for (x1, y1), (x2, y2) in sides
            if min(y1, y2) <= y < max(y1, y2)
        )
        for left, right in zip(crossings[0::2], crossings[1::2], strict=False):
            yield from ((x, y) for x in range(math.ceil(left), math.floor(right) + 1))
