"""Draw a recorded episode from above: floor, obstacles, target, the robot and its path."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO

from PIL import Image, ImageDraw

from palaestra_protocol.scene import TARGET_M
from palaestra_trainer.reporting.replay import view_of
from palaestra_trainer.reporting.run_data import Replay

GIF_PX = 360  # pixels of the longer side
MOST_PICTURES = 60
MOST_BYTES = 200_000
# Limits of the time for which a picture is shown. Browsers prolong a shorter time.
LONGEST_MS, SHORTEST_MS = 150, 20
LAST_MS = 1500
_COLORS = 32
_SMOOTH = 2  # pictures are drawn larger by this factor and then reduced, to smooth edges

# The colors that page.css has for a bright page.
_PAGE, _FLOOR, _OBSTACLE = (246, 247, 249), (238, 241, 245), (135, 148, 166)
_ROBOT, _WAY, _TARGET, _START = (31, 95, 191), (116, 156, 214), (23, 121, 74), (91, 102, 117)

Position = tuple[float, float]


def animated(replay: Replay) -> bytes:
    """Return an episode as a GIF of at most 200 kB that repeats; it lasts at most 11 s.

    The longer side of the GIF has 360 pixels. The GIF plays in real time or faster, because each picture
    lasts at most 0.15 s.

    Args:
        replay: the episode, with at least one pose.
    """
    most = MOST_PICTURES
    while len(content := _gif(replay, most)) > MOST_BYTES and most > 1:
        most //= 2
    return content


def _gif(replay: Replay, most: int) -> bytes:
    every = math.ceil(len(replay.poses) / most)
    drawn = list(pictures(replay, GIF_PX, every))
    palette = drawn[-1].quantize(_COLORS)  # the last picture has the whole path, and so all colors
    first, *others = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in drawn)
    picture_ms = min(max(round(1000 * every * replay.frame_s), SHORTEST_MS), LONGEST_MS)
    file = BytesIO()
    first.save(
        file,
        "GIF",
        save_all=True,
        append_images=others,
        duration=[*[picture_ms] * len(others), LAST_MS],
        loop=0,
    )
    return file.getvalue()


def pictures(replay: Replay, size_px: int, every: int = 1) -> Iterator[Image.Image]:
    """Yield a picture for each `every`-th pose, and a picture for the last pose.

    Args:
        replay: the episode, with at least one pose.
        size_px: the larger one of the width and the height of a picture; both are even numbers.
        every: number of poses per picture; with 1, each pose has a picture.
    """
    canvas = _Canvas.blank(replay, size_px)
    canvas.ground(replay)
    last = len(replay.poses) - 1
    for frame, (x, y, heading) in enumerate(replay.poses):
        if frame:
            canvas.line(replay.poses[frame - 1][:2], (x, y))
        if frame % every == 0 or frame == last:
            shown = canvas.copy()
            target = next(((tx, ty) for since, tx, ty in reversed(replay.targets) if since <= frame), None)
            if target is not None:
                shown.ring(target, TARGET_M, _TARGET)
                shown.disc(target, 0.04, _TARGET)
            shown.robot((x, y), heading, replay.radius_m)
            yield shown.picture()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Canvas:
    """A picture that is drawn in meters on the floor, with the y axis upward.

    Attributes:
        image: the picture, larger than the final picture by the factor `_SMOOTH`.
        low_x: x of the picture's left side.
        high_y: y of the picture's upper side.
        scale: pixels per meter.
    """

    image: Image.Image
    low_x: float
    high_y: float
    scale: float

    @classmethod
    def blank(cls, replay: Replay, size_px: int) -> _Canvas:
        """Return an empty canvas that is large enough for the floor and the path of an episode."""
        low_x, low_y, width, height = view_of(replay)
        scale = _SMOOTH * size_px / max(width, height)
        even = 2 * _SMOOTH
        columns, rows = (max(1, round(side * scale / even)) * even for side in (width, height))
        image = Image.new("RGB", (columns, rows), _PAGE)
        return cls(image=image, low_x=low_x, high_y=low_y + height, scale=scale)

    def copy(self) -> _Canvas:
        """Return a canvas with the same content."""
        return replace(self, image=self.image.copy())

    def picture(self) -> Image.Image:
        """Return the content in its final size."""
        return self.image.reduce(_SMOOTH)

    def ground(self, replay: Replay) -> None:
        """Draw the objects that do not move: the floor, the obstacles and the start."""
        if replay.low is not None and replay.high is not None:
            (low_x, low_y), (high_x, high_y) = replay.low, replay.high
            corners = [(low_x, low_y), (high_x, low_y), (high_x, high_y), (low_x, high_y)]
            self._polygon(corners, _FLOOR, outline=_OBSTACLE)
        for x, y, half_length, half_width, radius, heading in replay.outlines:
            self._rounded((x, y), (half_length, half_width), radius, heading)
        self.disc(replay.poses[0][:2], 4 * _SMOOTH / self.scale, _START)

    def line(self, start: Position, end: Position) -> None:
        """Draw a part of the robot's path."""
        ImageDraw.Draw(self.image).line([self._at(start), self._at(end)], fill=_WAY, width=2 * _SMOOTH)

    def disc(self, center: Position, radius_m: float, color: tuple[int, int, int]) -> None:
        """Draw a filled circle."""
        ImageDraw.Draw(self.image).circle(self._at(center), radius_m * self.scale, fill=color)

    def ring(self, center: Position, radius_m: float, color: tuple[int, int, int]) -> None:
        """Draw the outline of a circle."""
        ImageDraw.Draw(self.image).circle(
            self._at(center), radius_m * self.scale, outline=color, width=_SMOOTH
        )

    def robot(self, center: Position, heading_rad: float, radius_m: float) -> None:
        """Draw the robot, with a wedge that shows its heading."""
        self.disc(center, radius_m, _ROBOT)
        nose = [(radius_m, 0.0), (-radius_m / 3, radius_m / 2), (-radius_m / 3, -radius_m / 2)]
        self._polygon(_placed(nose, center, heading_rad), _PAGE)

    def _rounded(self, center: Position, half: Position, radius_m: float, heading_rad: float) -> None:
        corners = [(sx * half[0], sy * half[1]) for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
        for wide, high in ((radius_m, 0.0), (0.0, radius_m)):
            sides = [(x + math.copysign(wide, x), y + math.copysign(high, y)) for x, y in corners]
            self._polygon(_placed(sides, center, heading_rad), _OBSTACLE)
        for corner in _placed(corners, center, heading_rad):
            self.disc(corner, radius_m, _OBSTACLE)

    def _polygon(
        self,
        corners: Sequence[Position],
        color: tuple[int, int, int],
        outline: tuple[int, int, int] | None = None,
    ) -> None:
        ImageDraw.Draw(self.image).polygon(
            [self._at(each) for each in corners], fill=color, outline=outline, width=_SMOOTH
        )

    def _at(self, place: Position) -> Position:
        """Convert a position on the floor to pixels, counted from the upper left corner."""
        return (place[0] - self.low_x) * self.scale, (self.high_y - place[1]) * self.scale


def _placed(corners: Sequence[Position], center: Position, heading_rad: float) -> list[Position]:
    """Return corners that are given around the origin, rotated by a heading and moved to a center."""
    cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
    return [(center[0] + x * cosine - y * sine, center[1] + x * sine + y * cosine) for x, y in corners]
