"""A picture of pixels, and how lines, ovals and polygons are drawn on it. Pure.

Rows go from the top down, pixels from left to right; what is outside of the picture is not drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

Color = tuple[int, int, int, int]  # blue, green, red, alpha: the order of Webots' images
Point = tuple[int, int]

_BYTES = 4


@dataclass(slots=True, kw_only=True)
class Raster:
    """A picture of `width` by `height` pixels, transparent black at first; `pixels` has the colors by row."""

    width: int
    height: int
    pixels: bytearray = field(default_factory=bytearray)

    def __post_init__(self) -> None:
        """Make the pixels, if there are none."""
        if not self.pixels:
            self.pixels = bytearray(_BYTES * self.width * self.height)

    def at(self, x: int, y: int) -> Color:
        """Return the color of a pixel inside."""
        start = _BYTES * (y * self.width + x)
        blue, green, red, alpha = self.pixels[start : start + _BYTES]
        return blue, green, red, alpha

    def draw(self, points: Iterable[Point], color: Color, opacity: float = 1.0) -> None:
        """Give those pixels a color, mixed with what is there by the opacity."""
        for x, y in points:
            if 0 <= x < self.width and 0 <= y < self.height:
                start = _BYTES * (y * self.width + x)
                mixed = (
                    round(old + opacity * (new - old)) for old, new in zip(self.at(x, y), color, strict=True)
                )
                self.pixels[start : start + _BYTES] = bytes(mixed)

    def copy(self, x: int, y: int, width: int, height: int) -> Raster:
        """Return a part of the picture; what is outside of it is transparent."""
        part = Raster(width=width, height=height)
        for row in range(height):
            for column in range(width):
                if 0 <= x + column < self.width and 0 <= y + row < self.height:
                    part.draw([(column, row)], self.at(x + column, y + row))
        return part

    def paste(self, other: Raster, x: int, y: int) -> None:
        """Put another picture on this one; pixels without alpha are left out."""
        for row in range(other.height):
            for column in range(other.width):
                color = other.at(column, row)
                if color[3]:
                    self.draw([(x + column, y + row)], color)


def line(x1: int, y1: int, x2: int, y2: int) -> Iterator[Point]:
    """Yield the pixels of a line, ends included."""
    count = max(abs(x2 - x1), abs(y2 - y1))
    for index in range(count + 1):
        share = index / count if count else 0.0
        yield round(x1 + share * (x2 - x1)), round(y1 + share * (y2 - y1))


def rectangle(x: int, y: int, width: int, height: int) -> Iterator[Point]:
    """Yield the pixels of the frame of a rectangle."""
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
    """Yield all pixels of a polygon: those of its sides, and those between each second pair of sides."""
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
