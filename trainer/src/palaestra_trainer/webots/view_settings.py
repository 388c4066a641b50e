"""Labels over the view of a world, and the settings of its recordings."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class ViewLabel:
    """A text over the view of a world.

    Attributes:
        text: the text; "" removes the label.
        number: the number of the label, 0 or more.
        at: x and y of its upper left corner, 0 to 1 of the view, from the upper left corner of the view.
        size: the height of the font, 0 to 1 of the view.
        rgb: the color, 0xRRGGBB.
        transparency: 0 (opaque) to 1 (invisible).
        font: the name of a font of Webots.
    """

    text: str
    number: int = 0
    at: tuple[float, float] = (0.0, 0.0)
    size: float = 0.1
    rgb: int = 0xFF0000
    transparency: float = 0.0
    font: str = "Arial"


@dataclass(frozen=True, slots=True, kw_only=True)
class MovieSettings:
    """Settings of a recording.

    Attributes:
        size: width and height in pixels.
        quality: quality of the video, 1 to 100.
        acceleration: how many times faster than simulated time the movie plays.
        caption: whether the movie shows that acceleration.
    """

    size: tuple[int, int] = (640, 480)
    quality: int = 90
    acceleration: int = 1
    caption: bool = False
