"""The interface of cameras: the lens with which a physics renders, and the images that it returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol

from palaestra_sim.scene.nodes.scene_node import SceneNode

# A rectangle in an image: left, top, right and bottom in pixels from the top left corner of the image. The
# pixels at right and bottom are not part of the rectangle.
Corners = tuple[int, int, int, int]

MOST_PIXELS: Final = 4096  # limit of the pixels in a row and in a column
_WIDEST_RAD: Final = 3.1  # widest field of view of a flat image


@dataclass(slots=True, kw_only=True)
class Lens:
    """The lens of a camera; the camera looks along the x axis of its frame, with z up.

    Attributes:
        size: width and height in pixels.
        field_of_view_rad: the angle from the left edge to the right edge.
        near_m: the smallest visible distance.
        far_m: the greatest visible distance; 0 for no limit.
    """

    size: tuple[int, int]
    field_of_view_rad: float
    near_m: float
    far_m: float = 0.0

    @property
    def flat(self) -> bool:
        """Whether a flat image can show the whole field of view."""
        return 0.0 < self.field_of_view_rad <= _WIDEST_RAD


class CameraInterface(Protocol):
    """A camera of a physics that renders. Every image shows the world at the moment of the call."""

    def open(self) -> None:
        """Prepare to render.

        Raises:
            UnsimulatedError: this machine cannot render; the message names the packages to install.
        """
        ...

    def colors(self) -> bytes | memoryview:
        """Return blue, green, red and alpha of each pixel, one byte each, row by row from the top left."""
        ...

    def depths(self, nearest_m: float, resolution_m: float) -> bytes | memoryview:
        """Return a float32 for each pixel: its distance along the axis of the lens, in meters.

        A distance below `nearest_m`, or beyond the far end of the lens, is infinite. Other distances are
        multiples of `resolution_m`, if `resolution_m` is positive.
        """
        ...

    def patches(self, owner: Callable[[SceneNode], SceneNode | None]) -> Mapping[SceneNode, Corners]:
        """Return for each owner the rectangle around all its visible shapes.

        `owner` returns the node to which a shape belongs; None if the shape is not needed.
        """
        ...

    def painted(self, color: Callable[[SceneNode], bytes | None]) -> bytes | memoryview:
        """Return an image in which each shape has one color, without light, and the background is black.

        `color` returns the blue, green, red and alpha of a shape, one byte each; None for black.
        """
        ...
