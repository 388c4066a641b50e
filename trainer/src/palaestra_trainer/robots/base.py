"""The interfaces of all robots, of the Robotino, and of the scene around a simulated robot.

An environment uses only `RobotAbc` and the capabilities that it needs. Only a simulation can move objects to
the positions that an episode needs. So `Scene` is a separate interface, which a real robot lacks. This module
does not depend on the connection to a robot.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Self

from palaestra_trainer.robots.capabilities import Bumper, Distances, Localization, Omnidrive
from palaestra_trainer.robots.geometry import SPEED_M_S, TURN_RAD_S, Point, Pose
from palaestra_trainer.robots.layout import FloorLayout

RADIUS_M = 0.2266  # radius of the body's cylinder, as in Webots' model of the Robotino 3
OUTLINE_M = 0.2286  # radius of the body with its bumper
SENSORS = 9  # infrared sensors, one every 40 degrees
# Beyond an end of the range the sensor measures that end. Source: lookup table of the GP2Y0A41 in that model.
SENSOR_RANGE_M = (0.03, 0.40)


class RobotAbc(ABC):
    """A robot. Its capabilities are the classes of `capabilities` that it inherits.

    Any call may raise `SimulatorFault` if the robot is simulated. Readings change only in `advance`: between
    two calls of it, all readings describe the same moment. Before the first call they raise `NoReading`.
    """

    @property
    @abstractmethod
    def period_s(self) -> float:
        """Seconds that pass in one `advance`; constant."""

    @abstractmethod
    def advance(self) -> int:
        """Let one control period pass; return the number of extra periods, normally 0."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the robot itself, because a copy would drive the same robot.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self


class RobotinoAbc(RobotAbc, Omnidrive, Localization, Distances, Bumper):
    """A Robotino: a simulated one, a fake, or a real one.

    `distances` has shape (9,): the first sensor points forward, the others follow counter-clockwise every 40
    degrees.
    """

    radius_m = OUTLINE_M
    speed_m_s = SPEED_M_S
    turn_rad_s = TURN_RAD_S
    bearings_rad = tuple(2.0 * math.pi * sensor / SENSORS for sensor in range(SENSORS))
    distance_range_m = SENSOR_RANGE_M


class Scene(ABC):
    """Arranges episodes, which is possible only in a simulation.

    An episode begins in three steps: `begin` restores the initial positions of all objects, `layout` returns
    these positions, and `place` puts the robot on a free position.
    """

    @abstractmethod
    def begin(self, seed: int) -> None:
        """Begin an episode: all objects are at their initial positions and at rest.

        All random values until the next `begin` follow from `seed`, in [0, 2**32).
        """

    @abstractmethod
    def layout(self) -> FloorLayout:
        """Return the floor and the objects on it; objects that `put` has moved are at their new positions."""

    @abstractmethod
    def place(self, start: Pose, target: Point) -> None:
        """Put the robot at rest at `start` and the mark at `target` (x, y in meters); update all readings."""

    @abstractmethod
    def mark(self, target: Point) -> None:
        """Put the mark at `target` (x, y in meters) with the next period."""

    @abstractmethod
    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Put the node with DEF `name` to x, y, z (meters) with the next period; `begin` undoes it."""

    def reset(self, seed: int, start: Pose, target: Point) -> None:
        """Begin an episode with the robot and the mark at positions that were chosen without the layout."""
        self.begin(seed)
        self.place(start, target)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the scene itself, because a copy would arrange the same simulation.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self


class SceneWrapper(Scene):
    """A scene around another one; override the methods that should behave differently.

    Args:
        scene: the scene inside.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def begin(self, seed: int) -> None:
        """Begin an episode; override this method to change the world in every episode."""
        self.scene.begin(seed)

    def layout(self) -> FloorLayout:
        """Return the layout of the scene inside."""
        return self.scene.layout()

    def place(self, start: Pose, target: Point) -> None:
        """Put the robot and the mark."""
        self.scene.place(start, target)

    def mark(self, target: Point) -> None:
        """Put the mark."""
        self.scene.mark(target)

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Put a node."""
        self.scene.put(name, place)


class JointScene(ABC):
    """Arranges the joints of a simulated robot."""

    @abstractmethod
    def set_joint(self, name: str, position: float) -> None:
        """Move the joint with DEF `name` to radians or meters, at rest; `Scene.begin` undoes it."""
