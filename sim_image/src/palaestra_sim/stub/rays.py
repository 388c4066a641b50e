"""The distances that the sensor beams of a robot travel until they meet an obstacle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple, Protocol

from palaestra_sim.scene.geometry import Pose, Vector
from palaestra_sim.scene.hits import first_hit
from palaestra_sim.scene.sensor_rays import Beam, Ray
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.stub.obstacles import FlatObstacle, Neighborhood

_GROUND: Final = (0.0, 0.0, 1.0, 0.0)  # a frame in the format of `Fan.cast`


class Fan:
    """The rays of one robot in two dimensions; they are cast together, with one read of the robot's frame.

    Args:
        rays: the rays, in the robot's frame.
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
        """Set the obstacles of the rays: solids, and other robots."""
        self._solids = solids
        self._others = tuple(others)

    def cast(self, frame: tuple[float, float, float, float]) -> list[float]:
        """Return the distance in meters that each ray travels; at most the reach of the ray.

        `frame` is x, y, cosine and sine of the robot's heading. The next call changes the returned list.
        """
        distances = self.distances
        distances[:] = self._blank
        for solid in self._solids.near(frame[0], frame[1]):
            solid.scan(frame, self.rays, distances)
        for other in self._others:
            other.scan(frame, self.rays, distances)
        return distances


class Upright(NamedTuple):
    """An obstacle that has the same outline at every height between its lower and its upper end."""

    outline: FlatObstacle
    low_m: float
    high_m: float


class Rounded(NamedTuple):
    """An obstacle whose outline differs between heights.

    Attributes:
        shape: the shape of the obstacle.
        inward: the pose of the ground's axes in the frame of the shape.
    """

    shape: Shape
    inward: Pose

    def hit(self, origin: Vector, direction: Vector) -> float:
        """Return the distance in meters from `origin` to the surface along the unit vector `direction`.

        Both arguments are in the axes of the ground. The distance is infinite if the ray misses the shape.
        """
        return first_hit(self.shape, self.inward.carry(origin), self.inward.turned(direction))


class Met(Protocol):
    """An obstacle that computes where a ray meets its surface."""

    def hit(self, origin: Vector, direction: Vector) -> float:
        """Return the distance in meters from `origin` to the surface along the unit vector `direction`.

        Both arguments are in the axes of the ground. The distance is infinite if the ray misses the shape.
        """
        ...


class SlopedBeams:
    """The beams of one robot, which may be inclined; they are cast one by one.

    Floors are obstacles too; a floor extends to infinity.
    """

    __slots__ = ("_beams", "_floors", "_rounded", "_solids", "distances")

    def __init__(self, beams: Sequence[Beam]) -> None:
        self._beams = tuple(beams)
        self._solids: tuple[Upright, ...] = ()
        self._rounded: tuple[Met, ...] = ()
        self._floors: tuple[float, ...] = ()
        self.distances = [beam.reach_m for beam in beams]

    @property
    def free(self) -> bool:
        """Whether the beams have no obstacles except floors."""
        return not (self._solids or self._rounded)

    def face(
        self,
        solids: Sequence[Upright],
        floors_m: Sequence[float] = (0.0,),
        rounded: Sequence[Met] = (),
    ) -> None:
        """Set the obstacles of the beams.

        Args:
            solids: the upright obstacles.
            floors_m: the height of each floor.
            rounded: all other obstacles.
        """
        self._rounded = tuple(rounded)
        self._solids = tuple(solids)
        self._floors = tuple(floors_m)

    def cast(self, frame: tuple[float, float, float, float], height_m: float) -> list[float]:
        """Return the distance in meters that each beam travels; `height_m` is the height of the robot."""
        for index, beam in enumerate(self._beams):
            self.distances[index] = self._first(beam, frame, height_m)
        return self.distances

    def cast_from(self, pose: Pose) -> list[float]:
        """Return the distances for a robot that may be tilted; `pose` is its pose in the ground's axes."""
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
        for outline, low, high in self._solids:
            enter, leave = outline.crossing(frame, beam.ray)
            below, above = _between(low - start, high - start, beam.slope)
            enter = max(enter, below, 0.0)
            if enter <= min(leave, above):
                nearest = min(nearest, enter)
        return self._round(beam, frame, height_m, nearest * stretch)

    def _round(
        self, beam: Beam, frame: tuple[float, float, float, float], height_m: float, nearest_m: float
    ) -> float:
        """Return the distance at which a beam meets an obstacle of `_rounded`; at most `nearest_m`."""
        if not self._rounded:
            return nearest_m
        x, y, c, s = frame
        px, py, ux, uy = beam.ray
        stretch = math.hypot(1.0, beam.slope)
        origin = (x + c * px - s * py, y + s * px + c * py, beam.height_m + height_m)
        direction = ((c * ux - s * uy) / stretch, (s * ux + c * uy) / stretch, beam.slope / stretch)
        return min(nearest_m, *(it.hit(origin, direction) for it in self._rounded))


def _between(low_m: float, high_m: float, slope: float) -> tuple[float, float]:
    """Return the distances along the floor at which a beam enters and leaves the space between two heights.

    The heights are relative to the origin of the beam.
    """
    if slope == 0.0:
        return (-math.inf, math.inf) if low_m < 0.0 < high_m else (math.inf, -math.inf)
    return min(low_m / slope, high_m / slope), max(low_m / slope, high_m / slope)
