"""The interface of all robots, of the Robotino among them, and of the scene around a simulated one.

An environment is written against `RobotAbc` and the capabilities that it needs. What only a simulation can
do, putting things where an episode wants them, is apart in `Scene`: a real robot
has none. Nothing here knows how a robot is reached.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import Any, Self

from palaestra_trainer.robots.capabilities import Bumper, Distances, Localization, Omnidrive
from palaestra_trainer.robots.geometry import SPEED_M_S, TURN_RAD_S, Point, Pose
from palaestra_trainer.robots.layout import FloorLayout

RADIUS_M = 0.2266  # of the body's cylinder, as in Webots' model of the Robotino 3
OUTLINE_M = 0.2286  # of the body with its bumper
SENSORS = 9  # infrared, one every 40 degrees
# Both ends are what it says beyond them. Source: lookup table of the GP2Y0A41 in that model.
SENSOR_RANGE_M = (0.03, 0.40)


class RobotAbc(ABC):
    """A robot. Its capabilities are the classes of `capabilities` that it inherits.

    Any call may raise `SimulatorFault` where a simulator is behind it. Readings change in `advance` only:
    between two calls all of them describe the same moment. Before the first there are none: they raise
    `NoReading`.
    """

    @property
    @abstractmethod
    def period_s(self) -> float:
        """Seconds that pass in one `advance`; constant."""

    @abstractmethod
    def advance(self) -> int:
        """Let one control period pass; return how many extra ones had to (0 when all is well)."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: a copy would drive the same robot.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self


class RobotinoAbc(RobotAbc, Omnidrive, Localization, Distances, Bumper):
    """A Robotino, whether it is simulated, faked or stands in a laboratory.

    `distances` has shape (9,): the first looks forward, the others follow counter-clockwise every 40
    degrees.
    """

    radius_m = OUTLINE_M
    speed_m_s = SPEED_M_S
    turn_rad_s = TURN_RAD_S
    bearings_rad = tuple(2.0 * math.pi * sensor / SENSORS for sensor in range(SENSORS))
    distance_range_m = SENSOR_RANGE_M


class Scene(ABC):
    """Arranges episodes, which is possible in a simulation only.

    An episode begins in three steps: `begin` puts everything back to its place, `layout` returns where that
    is, and `place` puts the robot on a free place.
    """

    @abstractmethod
    def begin(self, seed: int) -> None:
        """Begin anew: everything is at its first place and at rest.

        All chance until the next `begin` follows from `seed`, in [0, 2**31).
        """

    @abstractmethod
    def layout(self) -> FloorLayout:
        """Return the floor, and what stands on it now; what `put` moved is at its new place."""

    @abstractmethod
    def place(self, start: Pose, target: Point) -> None:
        """Put the robot at rest at `start` and the mark at `target` (x, y in meters); fresh readings."""

    @abstractmethod
    def mark(self, target: Point) -> None:
        """Put the mark at `target` (x, y in meters) with the next period."""

    @abstractmethod
    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Put the node with DEF `name` to x, y, z (meters) with the next period; `begin` undoes it."""

    def reset(self, seed: int, start: Pose, target: Point) -> None:
        """Begin anew, with the robot and the mark at places that were chosen without the layout."""
        self.begin(seed)
        self.place(start, target)

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: a copy would arrange the same simulation.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self


class SceneWrapper(Scene):
    """A scene around another one; override the methods that should do something else.

    Args:
        scene: the scene inside.
    """

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def begin(self, seed: int) -> None:
        """Begin anew; override it to change the world in every episode."""
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
        """Put the joint with DEF `name` to radians or meters, at rest; `Scene.begin` undoes it."""
