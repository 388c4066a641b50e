"""A camera that MuJoCo renders; it implements `CameraInterface`."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.renderer import Renderer
from palaestra_sim.scene.camera_interface import Corners, Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.nodes.scene_node import SceneNode

_BLACK: Final = bytes((0, 0, 0, 255))


class MujocoCamera:
    """Renders images of the world from a frame through a lens."""

    def __init__(self, pictures: Renderer, place: Frame, lens: Lens) -> None:
        self._pictures = pictures
        self._place = place
        self._lens = lens

    def open(self) -> None:
        """Prepare to render."""
        self._pictures.open()

    def colors(self) -> memoryview:
        """Return blue, green, red and alpha of each pixel."""
        return self._pictures.colors(self._place, self._lens)

    def depths(self, nearest_m: float, resolution_m: float) -> memoryview:
        """Return the distance of each pixel in meters, as float32.

        A distance below `nearest_m` is infinite. If `resolution_m` is above 0, distances are rounded to it.
        """
        depths = self._pictures.depths(self._place, self._lens)
        depths[depths < nearest_m] = math.inf
        if resolution_m > 0.0:
            depths = np.round(depths / np.float32(resolution_m)) * np.float32(resolution_m)
        return memoryview(depths).cast("B")

    def patches(self, owner: Callable[[SceneNode], SceneNode | None]) -> dict[SceneNode, Corners]:
        """Return the image rectangle of each visible object; `owner` returns the object of a shape's node."""
        numbers = self._pictures.segments(self._place, self._lens)
        owners = [owner(thing.node) for thing in self._pictures.things]
        known = list(dict.fromkeys(it for it in owners if it is not None))
        # The table maps the number of a visible shape to the number of its owner; its last entry is for
        # pixels without a shape.
        table = np.array([*(-1 if it is None else known.index(it) for it in owners), -1])
        of_owner = table[numbers]
        return {known[at]: _corners(of_owner == at) for at in np.unique(of_owner).tolist() if at >= 0}

    def painted(self, color: Callable[[SceneNode], bytes | None]) -> memoryview:
        """Return an image in which each shape has the color that `color` returns for its node."""
        numbers = self._pictures.segments(self._place, self._lens)
        colors = [color(thing.node) or _BLACK for thing in self._pictures.things]
        table = np.frombuffer(b"".join((*colors, _BLACK)), np.uint8).reshape(-1, len(_BLACK))
        pixels: Any = table[numbers]
        return memoryview(pixels).cast("B")


def _corners(mask: Any) -> Corners:
    """Return the rectangle around the pixels that are set in a mask."""
    rows, columns = np.nonzero(mask)
    return int(columns.min()), int(rows.min()), int(columns.max()) + 1, int(rows.max()) + 1
