"""Rays: from the pose of a robot to what its sensors measure.

A ray stops at the first obstacle. As in Webots, its length goes through the sensor's lookup table: linear
between the rows, the end values beyond both ends, and Gaussian noise as a fraction of the response.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import Final, NamedTuple

from palaestra_sim.stub.physics.geometry import Pose, Vector, turn
from palaestra_sim.stub.physics.obstacles import Neighborhood, Obstacle, Ray

Row = tuple[float, float, float]  # distance in meters, response, noise as a fraction of the response


_LEVEL: Final = 1e-3  # a smaller slope counts as none
_STEEPEST: Final = 1e-6  # of a vertical ray: how far it goes along the floor for each meter


class LookupTable:
    """The response of a sensor to a distance.

    Args:
        rows: by growing distance; none: the response is the distance itself.
    """

    __slots__ = ("_bases", "_distances", "_noisy", "_slopes", "rows")

    def __init__(self, rows: Sequence[Row]) -> None:
        self.rows = tuple(rows) or ((0.0, 0.0, 0.0), (1e9, 1e9, 0.0))
        self._noisy = any(row[2] for row in self.rows)
        self._distances = [row[0] for row in self.rows]
        # Interval i lies before row i; the first and the last are flat.
        # (value, noise) = base + slope * distance.
        first, last = self.rows[0], self.rows[-1]
        self._bases = [(first[1], first[2])]
        self._slopes = [(0.0, 0.0)]
        for (d0, v0, n0), (d1, v1, n1) in pairwise(self.rows):
            slope = ((v1 - v0) / (d1 - d0), (n1 - n0) / (d1 - d0))
            self._slopes.append(slope)
            self._bases.append((v0 - slope[0] * d0, n0 - slope[1] * d0))
        self._bases.append((last[1], last[2]))
        self._slopes.append((0.0, 0.0))

    @property
    def reach_m(self) -> float:
        """The distance beyond which the response stays the same."""
        return self._distances[-1]

    @property
    def limits(self) -> tuple[float, float]:
        """The smallest and the largest response, without noise."""
        values = [row[1] for row in self.rows]
        return min(values), max(values)

    def response(self, distance_m: float, gauss: Callable[[float, float], float]) -> float:
        """Return the response to a distance, with noise drawn from `gauss(mean, deviation)`."""
        interval = bisect_right(self._distances, distance_m)
        base = self._bases[interval]
        slope = self._slopes[interval]
        value = base[0] + slope[0] * distance_m
        if self._noisy:
            return value * (1.0 + (base[1] + slope[1] * distance_m) * gauss(0.0, 1.0))
        return value


@cache
def lookup_table(*rows: Row) -> LookupTable:
    """Return the table of these rows, one for all sensors that have the same."""
    return LookupTable(rows)


class Fan:
    """All rays of one robot, cast together, so that its frame is computed once.

    Args:
        rays: in the robot's frame.
        reach_m: for each ray, the distance beyond which its value is constant.
    """

    __slots__ = ("_blank", "_others", "_reach", "_solids", "distances", "rays")

    def __init__(self, rays: Sequence[Ray], reach_m: Sequence[float]) -> None:
        self.rays = tuple(rays)
        self._blank = list(reach_m)
        self.distances = list(reach_m)
        farthest = max((x * x + y * y for x, y, _, _ in self.rays), default=0.0)
        self._reach = max(reach_m, default=0.0) + math.sqrt(farthest)
        self._solids = Neighborhood((), 0.0)
        self._others: tuple[Obstacle, ...] = ()

    @property
    def reach_m(self) -> float:
        """Return the longest distance of a ray's end from the robot's center."""
        return self._reach

    def face(self, solids: Neighborhood, others: Sequence[Obstacle]) -> None:
        """Set the obstacles of the rays: standing ones and robots."""
        self._solids = solids
        self._others = tuple(others)

    def cast(self, frame: tuple[float, float, float, float]) -> list[float]:
        """Return how far each ray travels in meters, from x, y, cos and sin of the heading.

        Rays that meet nothing have their full reach. The list is reused by the next call.
        """
        distances = self.distances
        distances[:] = self._blank
        for solid in self._solids.near(frame[0], frame[1]):
            solid.scan(frame, self.rays, distances)
        for other in self._others:
            other.scan(frame, self.rays, distances)
        return distances


class Beam(NamedTuple):
    """A ray that may look up or down: its trace on the floor, its height, and its slope.

    Attributes:
        ray: in the robot's frame, seen from above.
        height_m: of its origin, in the robot's frame.
        slope: how far it climbs for each meter along the floor.
        reach_m: the longest distance that matters.
    """

    ray: Ray
    height_m: float
    slope: float
    reach_m: float

    @property
    def level(self) -> bool:
        """Whether it stays at its height."""
        return self.slope == 0.0


def beam_along(pose: Pose, direction: Vector, reach_m: float) -> Beam:
    """Return the beam that leaves a frame in a direction of this frame."""
    dx, dy, dz = turn(pose.rotation, direction)
    along = max(math.hypot(dx, dy), _STEEPEST)
    slope = dz / along
    ray = pose.position[0], pose.position[1], dx / along, dy / along
    return Beam(ray, pose.position[2], slope if abs(slope) > _LEVEL else 0.0, reach_m)


class Upright(NamedTuple):
    """An obstacle with its lower and its upper end, in the world."""

    outline: Obstacle
    low_m: float
    high_m: float


class SlopedBeams:
    """The beams of one robot that climb or fall, cast one by one.

    Besides the obstacles there is a floor, at height 0 of the world.
    """

    __slots__ = ("_beams", "_others", "_solids", "distances")

    def __init__(self, beams: Sequence[Beam]) -> None:
        self._beams = tuple(beams)
        self._solids: tuple[Upright, ...] = ()
        self._others: tuple[Upright, ...] = ()
        self.distances = [beam.reach_m for beam in beams]

    def face(self, solids: Sequence[Upright], others: Sequence[Upright]) -> None:
        """Set the obstacles of the beams: standing ones and robots."""
        self._solids = tuple(solids)
        self._others = tuple(others)

    def cast(self, frame: tuple[float, float, float, float], height_m: float) -> list[float]:
        """Return how far each beam travels in meters; `height_m` is of the robot's frame."""
        for index, beam in enumerate(self._beams):
            self.distances[index] = self._first(beam, frame, height_m)
        return self.distances

    def _first(self, beam: Beam, frame: tuple[float, float, float, float], height_m: float) -> float:
        start = beam.height_m + height_m
        stretch = math.hypot(1.0, beam.slope)  # of the beam, for each meter along the floor
        nearest = beam.reach_m / stretch
        if beam.slope < 0.0:
            nearest = min(nearest, max(0.0, start / -beam.slope))
        for outline, low, high in (*self._solids, *self._others):
            enter, leave = outline.crossing(frame, beam.ray)
            below, above = _between(low - start, high - start, beam.slope)
            enter = max(enter, below, 0.0)
            if enter <= min(leave, above):
                nearest = min(nearest, enter)
        return nearest * stretch


def _between(low_m: float, high_m: float, slope: float) -> tuple[float, float]:
    """Return from where to where, along the floor, a beam is between two heights above its origin."""
    if slope == 0.0:
        return (-math.inf, math.inf) if low_m < 0.0 < high_m else (math.inf, -math.inf)
    return min(low_m / slope, high_m / slope), max(low_m / slope, high_m / slope)
