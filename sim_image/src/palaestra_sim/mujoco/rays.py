"""The distances that the sensor beams of a robot travel; the beams pass through the robot itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any, Final

import numpy as np

from palaestra_sim.mujoco.geoms import SEEN
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.model import Built
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.physics import Figure
from palaestra_sim.scene.sensor_rays import Beam

GROUPS: Final = np.array([int(group == SEEN) for group in range(mujoco.mjNGROUP)], dtype=np.uint8)


class Beams:
    """The beams of one robot; beams with the same origin are cast together."""

    def __init__(self, figure: Figure, beams: Sequence[Beam], mount: Frame | None = None) -> None:
        self._figure = figure
        self._mount = mount or figure.place
        self._reach = np.array([beam.reach_m for beam in beams])
        self._origins, self._directions = origins_and_directions(beams)
        self._distances = np.empty(len(beams))
        self._hits = np.empty(len(beams), dtype=np.int32)
        self._bundles = bundles(self._origins)

    def cast(self, built: Built) -> list[float]:
        """Return the distance in meters that each beam travels; at most the reach of the beam."""
        pose = self._mount.ground_pose
        turned = np.array(pose.rotation).reshape(3, 3)
        origins = self._origins @ turned.T + pose.position
        directions = self._directions @ turned.T
        own = built.body_of(self._figure)
        with built.unseen(self._figure):
            for first, end in self._bundles:
                self._cast(built, origins[first], directions[first:end].ravel(), own, slice(first, end))
        distances = self._distances
        self._meet_floors_from_below(built, origins, directions)
        missed = (distances < 0.0) | (distances > self._reach)
        travelled: list[float] = np.where(missed, self._reach, distances).tolist()
        return travelled

    def _meet_floors_from_below(self, built: Built, origins: Any, directions: Any) -> None:
        """Shorten the beams that meet a floor from below; MuJoCo's rays pass through a plane from below."""
        for height_m in built.floors_m:
            ways = height_m - origins[:, 2]
            if ways.max(initial=0.0) > 0.0:
                rising = (ways > 0.0) & (directions[:, 2] > 0.0)
                met = ways[rising] / directions[rising, 2]
                before = self._distances[rising]
                self._distances[rising] = np.where(before < 0.0, met, np.minimum(before, met))

    def _cast(self, built: Built, origin: Any, directions: Any, own: int, part: slice) -> None:
        count = part.stop - part.start
        mujoco.mj_multiRay(
            built.model,
            built.data,
            origin,
            directions,
            GROUPS,
            True,
            own,
            self._hits[part],
            self._distances[part],
            None,
            count,
            mujoco.mjMAXVAL,
        )


def bundles(origins: Any) -> list[tuple[int, int]]:
    """Return the first index and the end index of each run of consecutive beams with the same origin."""
    order = groupby(range(len(origins)), key=lambda index: tuple(origins[index]))
    return [(run[0], run[-1] + 1) for _, indices in order if (run := list(indices))]


def origins_and_directions(beams: Sequence[Beam]) -> tuple[Any, Any]:
    """Return the origins (in meters) and unit directions of beams in the robot's frame, (n, 3) each."""
    origins = np.array([[beam.ray[0], beam.ray[1], beam.height_m] for beam in beams])
    stretch = [math.hypot(1.0, beam.slope) for beam in beams]
    directions = np.array(
        [
            [beam.ray[2] / along, beam.ray[3] / along, beam.slope / along]
            for beam, along in zip(beams, stretch, strict=True)
        ]
    )
    return origins, directions
