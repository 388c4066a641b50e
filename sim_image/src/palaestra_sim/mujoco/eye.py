"""A camera in MuJoCo: see `Eye`."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from palaestra_sim.mujoco.pictures import Pictures
from palaestra_sim.scene.eyes import Lens, Patch
from palaestra_sim.scene.places import Place


class MujocoEye:
    """A place and a lens, and the pictures of the world from there."""

    def __init__(self, pictures: Pictures, place: Place, lens: Lens) -> None:
        self._pictures = pictures
        self._place = place
        self._lens = lens

    def open(self) -> None:
        """Get ready to draw."""
        self._pictures.open()

    def colors(self) -> memoryview:
        """Return blue, green, red and alpha of each pixel."""
        return self._pictures.colors(self._place, self._lens)

    def depths(self, nearest_m: float, resolution_m: float) -> memoryview:
        """Return the distance of each pixel."""
        depths = self._pictures.depths(self._place, self._lens)
        depths[depths < nearest_m] = math.inf
        if resolution_m > 0.0:
            depths = np.round(depths / np.float32(resolution_m)) * np.float32(resolution_m)
        return memoryview(depths).cast("B")

    def patches(self) -> list[Patch]:
        """Return what is visible, and where in the picture."""
        return list(self._patches())

    def _patches(self) -> Iterator[Patch]:
        numbers = self._pictures.segments(self._place, self._lens)
        things = self._pictures.things
        for number in np.unique(numbers).tolist():
            if number >= 0:
                rows, columns = np.nonzero(numbers == number)
                left, top = int(columns.min()), int(rows.min())
                right, bottom = int(columns.max()) + 1, int(rows.max()) + 1
                yield Patch(things[number].node, (left, top, right, bottom))
