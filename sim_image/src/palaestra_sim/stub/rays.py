"""The distances that the beams of a robot travel. A ray stops at the first obstacle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from palaestra_sim.scene.geometry import Pose
from palaestra_sim.scene.sensor_rays import Beam, Ray
from palaestra_sim.stub.obstacles import FlatObstacle, Neighborhood

_GROUND: Final = (0.0, 0.0, 1.0, 0.0)  # a frame in the format of `Fan.cast`


class Fan:
    """All rays of one robot, cast together, so that its frame is computed once.

    Args:
        rays: in the robot's frame.
        reach_m: for each ray, the distance beyond which the sensor's value is constant.
    """

    __slots__ = ("_blank", "_others", "_reach", "_solids", "distances", "rays")

    def __init__(self, rays: Sequence[Ray], reach_m: Sequence[float]) -> None:
        self.rays = tuple(rays)
        self._blank = list(reach_m)
        self.distances = list(reach_m)
        farthest = max((x * x + y * y for x, y, _, _ in self.rays), default=0.0)
        self._reach = max(reach_m, default=0.0) + math.sqrt(farthest)
        self._solids = Neighborhood((), 0.0)
        self._others: tuple[FlatObstacle, ...] = ()

    @property
    def reach_m(self) -> float:
        """Return an upper bound on the distance between the end of a ray and the robot's center."""
        return self._reach

    def face(self, solids: Neighborhood, others: Sequence[FlatObstacle]) -> None:
        """Set the obstacles of the rays: fixed ones and robots."""
        self._solids = solids
        self._others = tuple(others)

    def cast(self, frame: tuple[float, float, float, float]) -> list[float]:
        """Return the distance that each ray travels in meters; `frame` is x, y, cos and sin of the heading.

        Rays that meet nothing have their full reach. The next call reuses the list.
        """
        distances = self.distances
        distances[:] = self._blank
        for solid in self._solids.near(frame[0], frame[1]):
            solid.scan(frame, self.rays, distances)
        for other in self._others:
            other.scan(frame, self.rays, distances)
        return distances


class Upright(NamedTuple):
    """An obstacle with its lower and its upper end, in the world."""

    outline: FlatObstacle
    low_m: float
    high_m: float


class SlopedBeams:
    """The beams of one robot that point up or down, cast one by one.

    Their obstacles include floors, which extend to infinity.
    """

    __slots__ = ("_beams", "_floors", "_others", "_solids", "distances")

    def __init__(self, beams: Sequence[Beam]) -> None:
        self._beams = tuple(beams)
        self._solids: tuple[Upright, ...] = ()
        self._others: tuple[Upright, ...] = ()
        self._floors: tuple[float, ...] = ()
        self.distances = [beam.reach_m for beam in beams]

    def face(
        self, solids: Sequence[Upright], others: Sequence[Upright], floors_m: Sequence[float] = (0.0,)
    ) -> None:
        """Set the obstacles of the beams: fixed ones and robots, and the heights of floors."""
        self._solids = tuple(solids)
        self._others = tuple(others)
        self._floors = tuple(floors_m)

    def cast(self, frame: tuple[float, float, float, float], height_m: float) -> list[float]:
        """Return the distance that each beam travels, in meters; `height_m` is that of the robot's frame."""
        for index, beam in enumerate(self._beams):
            self.distances[index] = self._first(beam, frame, height_m)
        return self.distances

    def cast_from(self, pose: Pose) -> list[float]:
        """Return the same for a robot that may be tilted; `pose` is its frame in the axes of the ground."""
        for index, beam in enumerate(self._beams):
            self.distances[index] = self._first(beam.seen_from(pose), _GROUND, 0.0)
        return self.distances

    def _first(self, beam: Beam, frame: tuple[float, float, float, float], height_m: float) -> float:
        start = beam.height_m + height_m
        stretch = math.hypot(1.0, beam.slope)  # length of the beam for each meter along the floor
        nearest = beam.reach_m / stretch
        if beam.slope:
            for floor in self._floors:
                along = (floor - start) / beam.slope
                if along >= 0.0:
                    nearest = min(nearest, along)
        for outline, low, high in (*self._solids, *self._others):
            enter, leave = outline.crossing(frame, beam.ray)
            below, above = _between(low - start, high - start, beam.slope)
            enter = max(enter, below, 0.0)
            if enter <= min(leave, above):
                nearest = min(nearest, enter)
        return nearest * stretch


def _between(low_m: float, high_m: float, slope: float) -> tuple[float, float]:
    """Return the distances along the floor between which a beam is within two heights above its origin."""
    if slope == 0.0:
        return (-math.inf, math.inf) if low_m < 0.0 < high_m else (math.inf, -math.inf)
    return min(low_m / slope, high_m / slope), max(low_m / slope, high_m / slope)
