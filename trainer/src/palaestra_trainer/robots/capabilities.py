"""The capabilities of robots, one class each, and a check that a robot has those that a task needs.

A robot inherits each capability that it has. An environment lists in `needs` the capabilities that its task
needs. So a task names no robot and a robot names no task, and a pair that does not fit is refused before a
simulator starts. Readings change only in `RobotAbc.advance`: between two calls of it, all readings describe
the same moment. This module does not depend on the connection to a robot.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import MissingCapability
from palaestra_trainer.robots.geometry import Movement, Pose


class Steering(ABC):
    """A robot that drives forward and turns.

    Attributes:
        radius_m: meters from its center to the farthest point of its outline.
        speed_m_s: its greatest speed.
        turn_rad_s: its greatest rate of turning.
    """

    radius_m: ClassVar[float]
    speed_m_s: ClassVar[float]
    turn_rad_s: ClassVar[float]

    @abstractmethod
    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity: forward in m/s, counter-clockwise in rad/s, until changed."""


class Omnidrive(Steering):
    """A robot that drives in every direction on the floor, and turns."""

    @abstractmethod
    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the wanted velocity: forward, left (m/s) and counter-clockwise (rad/s), until changed."""

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity, without motion to the side, until changed."""
        self.drive(forward, 0.0, turn)

    def move(self, movement: Movement) -> None:
        """Drive at the speeds of `movement` until the next command."""
        self.drive(*movement.twist)


class Localization(ABC):
    """A robot that knows its pose."""

    @abstractmethod
    def pose(self) -> Pose:
        """Return the true pose in a simulation, odometry (which drifts) on a real robot."""


class Distances(ABC):
    """A robot with distance sensors on its outline.

    Attributes:
        bearings_rad: the direction of each sensor, counter-clockwise from forward.
        distance_range_m: smallest and greatest distance that they measure; others count as the nearer end.
    """

    bearings_rad: ClassVar[tuple[float, ...]]
    distance_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, one number for each of `bearings_rad`."""


class Bumper(ABC):
    """A robot with a bumper."""

    @abstractmethod
    def bumped(self) -> bool:
        """Return whether the bumper touches something."""


class Cameras(ABC):
    """A robot with a color camera, a depth camera, or both."""

    @abstractmethod
    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Make the chosen cameras render an image in each later `advance`; they stay in use.

        A camera that is not in use costs no time.

        Raises:
            NoSuchSensor: the robot lacks one of them. A simulated robot that is not connected yet raises
                `WorldMisfit` when it connects.
        """

    @abstractmethod
    def color_image(self) -> NDArray[np.uint8]:
        """Return the image of the camera, shape (height, width, 3), RGB; valid until the next `advance`.

        Raises:
            NoSuchSensor: no color camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """

    @abstractmethod
    def depth_image(self) -> NDArray[np.float32]:
        """Return meters for each pixel, shape (height, width); valid until the next `advance`.

        Meters are measured parallel to the optical axis; pixels without an object in range are infinite.

        Raises:
            NoSuchSensor: no depth camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """


class Scanner(ABC):
    """A robot with a laser scanner of one layer.

    Attributes:
        scan_view_rad: the angle that it covers, half of it on either side of forward.
        scan_range_m: smallest and greatest distance that it measures; others count as the nearer end.
    """

    scan_view_rad: ClassVar[float]
    scan_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_scanner(self) -> None:
        """Make the scanner measure in each later `advance`; it stays in use.

        A scanner that is not in use costs no time.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def scan(self) -> NDArray[np.float32]:
        """Return meters from the scanner, shape (rays,), counter-clockwise from the rightmost ray.

        Raises:
            NoSuchSensor: the scanner is not in use.
            NoReading: no period has passed since `use_scanner`.
        """


class Joints(ABC):
    """A robot with joints that it moves and measures.

    Attributes:
        motors: names of its motors.
        sensors: names of the sensors of its joints.
        greatest: the greatest command of each motor, in the unit of `command`.
    """

    motors: ClassVar[tuple[str, ...]]
    sensors: ClassVar[tuple[str, ...]]
    greatest: ClassVar[tuple[float, ...]]

    @abstractmethod
    def joints(self) -> NDArray[np.float64]:
        """Return the readings of `sensors`, shape (sensors,): radians, meters, and their rates."""

    @abstractmethod
    def command(self, values: Iterable[float]) -> None:
        """Set the command of each motor, until changed: a force, a torque, a velocity or a position."""


class Gripper(ABC):
    """A robot with a gripper."""

    @abstractmethod
    def use_gripper(self) -> None:
        """Start to use the gripper's motors; before that they cost no time.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def grip(self, opening: float) -> None:
        """Open the gripper to a share of its width, from 0 (closed) to 1, from the next period on."""


class Forklift(ABC):
    """A robot with a fork that lifts.

    Attributes:
        lift_range_m: least and greatest height of the fork.
    """

    lift_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_forklift(self) -> None:
        """Start to use the fork's motor; before that it costs no time.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def lift(self, height_m: float) -> None:
        """Move the fork to a height in `lift_range_m`, from the next period on."""


CAPABILITIES: tuple[type, ...] = (
    Steering,
    Omnidrive,
    Localization,
    Distances,
    Bumper,
    Cameras,
    Scanner,
    Joints,
    Gripper,
    Forklift,
)


def require(robot: object, needs: Iterable[type], by: str) -> None:
    """Check that a robot has every capability in `needs`; `by` is the name of the task in the error.

    Raises:
        MissingCapability: it lacks some.
    """
    if missing := [need.__name__ for need in needs if not isinstance(robot, need)]:
        has = [known.__name__ for known in CAPABILITIES if isinstance(robot, known)]
        raise MissingCapability(
            f"trainer.robot: {type(robot).__name__} has no {' and no '.join(missing)}, which {by} needs; "
            f"it has {', '.join(has) or 'no capability'}. Use a robot or a task that fits the other"
        )
