"""The rays of a lidar: their directions, and their beams in the frame of the mount. Pure.

Source: WbLidar.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.sensor_rays import Beam, beam_along


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LidarRays:
    """The rays of a lidar by layer and column.

    Attributes:
        frame: the pose of the sensor in its mount; the sensor looks along x, with z up.
        layers: the number of layers, from the top down.
        columns: the number of rays in each layer.
        wide_rad: the angle over which a fixed lidar spreads the rays of a layer.
        high_rad: the angle from the first layer to the last.
        tilt_rad: the angle by which the lidar is tilted upward.
        reach_m: the length of the rays.
        rotates: whether the rays are on a rotating head, and spread over a full turn.
    """

    frame: Pose
    layers: int
    columns: int
    wide_rad: float
    high_rad: float
    tilt_rad: float
    reach_m: float
    rotates: bool
    _known: dict[int, Sequence[Vector]] = field(default_factory=dict, init=False)

    def layer(self, layer: int) -> Sequence[Vector]:
        """Return the directions of the rays of a layer, unit vectors in the frame of the sensor."""
        if layer not in self._known:
            self._known[layer] = tuple(self._direction(layer, column) for column in range(self.columns))
        return self._known[layer]

    def beams(self, layer: int, columns: Iterable[int]) -> list[Beam]:
        """Return some rays of a layer in the frame of the mount."""
        directions = self.layer(layer)
        return [beam_along(self.frame, directions[column], self.reach_m) for column in columns]

    def _direction(self, layer: int, column: int) -> Vector:
        up_rad = self.high_rad * (0.5 - layer / (self.layers - 1)) if self.layers > 1 else 0.0
        share = (column + 0.5) / self.columns
        if self.rotates:  # the head tilts, so each ray of the head points upward by the tilt
            return _towards(-math.tau * share, up_rad + self.tilt_rad)
        x, y, z = _towards(self.wide_rad * (0.5 - share), up_rad)
        cosine, sine = math.cos(self.tilt_rad), math.sin(self.tilt_rad)
        return x * cosine - z * sine, y, x * sine + z * cosine


def _towards(left_rad: float, up_rad: float) -> Vector:
    flat = math.cos(up_rad)
    return flat * math.cos(left_rad), flat * math.sin(left_rad), math.sin(up_rad)
