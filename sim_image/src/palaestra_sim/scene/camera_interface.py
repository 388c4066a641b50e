"""What cameras see: the lens through which a physics draws, and the pictures that it returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from palaestra_sim.scene.nodes.scene_node import SceneNode

# Left, top, right and bottom in pixels from the top left; the last two are outside.
Corners = tuple[int, int, int, int]

MOST_PIXELS: Final = 4096  # in a row or column
_WIDEST_RAD: Final = 3.1  # of a picture that is flat


@dataclass(slots=True, kw_only=True)
class Lens:
    """The lens of a camera, which looks along the x axis of its place, with z up.

    Attributes:
        size: width and height in pixels.
        field_of_view_rad: from the left edge to the right one.
        near_m: the nearest visible distance.
        far_m: the farthest visible distance; 0: there is none.
    """

    size: tuple[int, int]
    field_of_view_rad: float
    near_m: float
    far_m: float = 0.0

    @property
    def flat(self) -> bool:
        """Whether a flat picture shows all of it."""
        return 0.0 < self.field_of_view_rad <= _WIDEST_RAD


class CameraInterface(Protocol):
    """A camera of a physics that draws. Every picture shows the world as it is at the call."""

    def open(self) -> None:
        """Get ready to draw.

        Raises:
            UnsimulatedError: this machine cannot draw; the message names what to install.
        """
        ...

    def colors(self) -> bytes | memoryview:
        """Return blue, green, red and alpha of each pixel, a byte each, row by row from the top left."""
        ...

    def depths(self, nearest_m: float, resolution_m: float) -> bytes | memoryview:
        """Return a float32 for each pixel: its distance along the axis of the lens, in meters.

        A distance below `nearest_m`, or beyond the far end of the lens, is infinite. Other distances are
        multiples of `resolution_m`, if that is positive.
        """
        ...

    def patches(self, owner: Callable[[SceneNode], SceneNode | None]) -> Mapping[SceneNode, Corners]:
        """Return where each owner is visible: the rectangle around all its shapes.

        `owner` returns what a shape is part of, None if it is of no interest.
        """
        ...

    def painted(self, color: Callable[[SceneNode], bytes | None]) -> bytes | memoryview:
        """Return a picture in which each shape has one color, without light, and the rest is black.

        `color` returns the blue, green, red and alpha of a shape, a byte each, None for black.
        """
        ...
