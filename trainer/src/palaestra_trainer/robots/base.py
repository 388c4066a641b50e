"""The interfaces of robots, of the Robotino, and of the scene around a simulated robot.

An environment uses only `RobotAbc` and the capabilities that its task needs. Only a simulation can move
objects to the positions that an episode needs. So `Scene` is a separate interface, which a real robot does
not have. This module does not depend on the connection to a robot.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, ClassVar, Self

from palaestra_trainer.robots.capabilities import Bumper, Distances, Localization, Omnidrive
from palaestra_trainer.robots.geometry import SPEED_M_S, TURN_RAD_S, Point, Pose
from palaestra_trainer.robots.layout import FloorLayout

RADIUS_M = 0.2266  # radius of the body's cylinder, as in Webots' model of the Robotino 3
OUTLINE_M = 0.2286  # radius of the body with its bumper
SENSORS = 9  # number of infrared sensors, one every 40 degrees
# For a distance outside this range, the sensor returns the nearer bound. Source: lookup table of the GP2Y0A41
# in Webots' model of the Robotino 3.
SENSOR_RANGE_M = (0.03, 0.40)


class RobotAbc(ABC):
    """A robot; its capabilities are the classes of `capabilities` that its class inherits.

    If the robot is simulated, any call may raise `SimulatorFault`. Readings change only in `advance`, so
    between two calls of `advance` all readings describe the same moment. Before the first call of `advance`,
    a reading raises `NoReading`.

    Attributes:
        real: whether the robot is real. Disturbances that make a policy robust are only for simulated robots.
    """

    real: ClassVar[bool] = False

    @property
    @abstractmethod
    def period_s(self) -> float:
        """The seconds that pass in one `advance`, a constant."""

    @abstractmethod
    def advance(self) -> int:
        """Advance the robot by one control period; return the number of extra periods, normally 0."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the robot itself, because a copy would drive the same robot.

        gymnasium copies the arguments of an environment, so this method is needed.
        """
        del memo
        return self


class RobotinoAbc(RobotAbc, Omnidrive, Localization, Distances, Bumper):
    """The interface of a Robotino, which may be simulated, fake or real.

    `distances` has shape (9,). The first sensor points forward, and the others follow counter-clockwise every
    40 degrees.
    """

    radius_m = OUTLINE_M
    speed_m_s = SPEED_M_S
    turn_rad_s = TURN_RAD_S
    bearings_rad = tuple(2.0 * math.pi * sensor / SENSORS for sensor in range(SENSORS))
    distance_range_m = SENSOR_RANGE_M


class Scene(ABC):
    """Places the robot and other objects for episodes; only a simulation can place objects.

    An episode begins in three steps. `begin` restores the initial positions of all objects, `layout` returns
    these positions, and `place` puts the robot on a free position.
    """

    @abstractmethod
    def begin(self, seed: int) -> None:
        """Begin an episode: move all objects to their initial positions, at rest.

        All random values until the next `begin` follow from `seed`, in [0, 2**32).
        """

    @abstractmethod
    def layout(self) -> FloorLayout:
        """Return the floor and the objects on it, with the new positions of objects that `put` has moved."""

    @abstractmethod
    def place(self, start: Pose, target: Point) -> None:
        """Put the resting robot at `start` and the mark at `target` (x, y in meters); update all readings."""

    @abstractmethod
    def mark(self, target: Point) -> None:
        """Move the mark to `target` (x, y in meters) in the next control period."""

    @abstractmethod
    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Move the node with DEF `name` to x, y, z (meters) in the next period; `begin` undoes this."""

    def reset(self, seed: int, start: Pose, target: Point) -> None:
        """Begin an episode with the robot and the mark at given positions, without reading the layout."""
        self.begin(seed)
        self.place(start, target)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return the scene itself, because a copy would arrange the same simulation.

        gymnasium copies the arguments of an environment, so this method is needed.
        """
        del memo
        return self


class SceneWrapper(Scene):
    """A scene that forwards all calls to another scene; override the methods that should differ.

    Args:
        scene: the inner scene, which gets the calls.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def begin(self, seed: int) -> None:
        """Begin an episode; override this method to change the world in every episode."""
        self.scene.begin(seed)

    def layout(self) -> FloorLayout:
        """Return the layout of the inner scene."""
        return self.scene.layout()

    def place(self, start: Pose, target: Point) -> None:
        """Put the robot and the mark at their positions in the inner scene."""
        self.scene.place(start, target)

    def mark(self, target: Point) -> None:
        """Move the mark in the inner scene."""
        self.scene.mark(target)

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Move a node in the inner scene."""
        self.scene.put(name, place)


class JointScene(ABC):
    """Sets the positions of a simulated robot's joints."""

    @abstractmethod
    def set_joint(self, name: str, position: float) -> None:
        """Move the joint with DEF `name` to a position in radians or meters; `Scene.begin` undoes this."""
