"""The test picture of the mock robot's camera: a function of the robot's pose alone.

The stub does not render, so the picture does not show the world. It shows a gray floor, a lighter sky, and
one red pole, 0.5 m high and 0.2 m wide, at the origin of the world. Nothing hides the pole. The camera is in
the center of the robot, 0.25 m above the floor, and sees 60 degrees.
"""

from __future__ import annotations

import math
from typing import Final

from palaestra_sim.scene.picture_files import jpeg

SIZE: Final = (320, 240)
SKY, FLOOR, POLE = (200, 200, 200), (90, 90, 90), (200, 20, 20)  # red, green, blue
_POLE_M: Final = (0.1, 0.5)  # half of the width, and the height
_ABOVE_M: Final = 0.25
_NEAR_M: Final = 0.05
_FOCAL: Final = 0.5 * SIZE[0] / math.tan(math.radians(30.0))


def picture(x: float, y: float, heading_rad: float) -> bytes:
    """Return the picture at a pose as a JPEG file.

    Raises:
        UnsimulatedError: Pillow is not installed.
    """
    width, height = SIZE
    columns, top, bottom = _pole(x, y, heading_rad)
    rows: list[bytes] = []
    for row in range(height):
        back = _pixel(SKY if row < height // 2 else FLOOR)
        inside = columns if top <= row < bottom else range(0)
        right = width - inside.start - len(inside)
        rows.append(back * inside.start + _pixel(POLE) * len(inside) + back * right)
    return jpeg(SIZE, b"".join(rows), quality=90)


def _pole(x: float, y: float, heading_rad: float) -> tuple[range, int, int]:
    """Return the columns of the pole, its first row, and the row below its last row."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    forward, left = -x * c - y * s, x * s - y * c
    if forward < _NEAR_M:
        return range(0), 0, 0
    half_m, high_m = _POLE_M
    edges = (_column((left + half_m) / forward), _column((left - half_m) / forward))
    middle = SIZE[1] // 2
    top = round(middle - _FOCAL * (high_m - _ABOVE_M) / forward)
    return range(*edges), max(top, 0), min(round(middle + _FOCAL * _ABOVE_M / forward), SIZE[1])


def _column(slope: float) -> int:
    return min(max(round(0.5 * SIZE[0] - _FOCAL * slope), 0), SIZE[0])


def _pixel(color: tuple[int, int, int]) -> bytes:
    red, green, blue = color
    return bytes((blue, green, red, 255))
