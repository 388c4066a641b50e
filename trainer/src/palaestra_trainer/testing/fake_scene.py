"""The arena's floor, and the scene of the fake robots."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from palaestra_trainer.errors import WrongData
from palaestra_trainer.robots.base import Scene
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout, Obstacle

HALF_SIDE_M = 2.0  # from the center of the arena to the inner faces of the walls
CYLINDERS = ((0.8, 0.8), (-0.8, 0.8), (-0.8, -0.8), (0.8, -0.8))
CYLINDER_RADIUS_M = 0.25  # too wide to stand undetected between two infrared rays of the robot
CYLINDER_HEIGHT_M = 0.4
STORED_M = -0.7  # height of the center of a cylinder that is stored under the floor of the world `seeing`


def arena(cylinders: Iterable[Point] = CYLINDERS, height_m: float = 0.5 * CYLINDER_HEIGHT_M) -> FloorLayout:
    """Return the arena of the shipped world with cylinders at these positions, centered at `height_m`."""
    half = 0.5 * CYLINDER_HEIGHT_M
    return FloorLayout(
        low=(-HALF_SIDE_M, -HALF_SIDE_M),
        high=(HALF_SIDE_M, HALF_SIDE_M),
        obstacles=tuple(
            Obstacle(
                name=f"CYLINDER_{number}",
                x_m=x_m,
                y_m=y_m,
                bottom_m=height_m - half,
                top_m=height_m + half,
                radius_m=CYLINDER_RADIUS_M,
            )
            for number, (x_m, y_m) in enumerate(cylinders)
        ),
    )


class Placed(Protocol):
    """The interface of a fake robot that its scene uses."""

    target: Point

    @property
    def layout(self) -> FloorLayout:
        """The floor and the obstacles on it."""
        ...

    @layout.setter
    def layout(self, layout: FloorLayout) -> None: ...

    def place(self, pose: Pose, seed: int) -> None:
        """Put the robot at `pose`, at rest, and update all readings; `seed` decides the noise."""
        ...


class FakeScene(Scene):
    """The scene of a fake robot on a floor.

    Args:
        robot: the fake robot that the scene places.
        layout: the floor and the obstacles on it at the start of each episode.
    """

    def __init__(self, robot: Placed, layout: FloorLayout | None = None) -> None:
        self._robot = robot
        self._first = layout or arena()
        self._seed = 0
        self._things = {thing.name: thing for thing in self._first.obstacles}
        robot.layout = self._first

    @property
    def target(self) -> Point:
        """The position of the mark: x, y in meters."""
        return self._robot.target

    def begin(self, seed: int) -> None:
        """Put all obstacles back to their initial positions."""
        self._seed = seed
        self._things = {thing.name: thing for thing in self._first.obstacles}
        self._robot.layout = self._first

    def layout(self) -> FloorLayout:
        """Return the floor and the current obstacles on it."""
        return self._robot.layout

    def place(self, start: Pose, target: Point) -> None:
        """Put the robot at `start`, at rest, and the mark at `target`."""
        self.mark(target)
        self._robot.place(start, self._seed)

    def mark(self, target: Point) -> None:
        """Put the mark at `target`."""
        self._robot.target = target

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Move an obstacle to x, y, z (meters) until the next `begin`.

        Raises:
            WrongData: no obstacle has that name.
        """
        if name not in self._things:
            raise WrongData("fake", f"the world has no node DEF {name}")
        self._things[name] = self._things[name].moved(*place)
        low, high = self._first.low, self._first.high
        self._robot.layout = FloorLayout(low=low, high=high, obstacles=tuple(self._things.values()))
