"""The capabilities of robots as classes, and a check that a robot has the capabilities of a task.

A robot's class inherits the class of each capability that it has. An environment lists in `needs` the
capabilities that its task needs. So the code of a task does not depend on a robot, nor a robot on a task. A
robot without a needed capability is refused before a simulator starts. Readings change only in
`RobotAbc.advance`, so between two calls of `advance` all readings describe the same moment. This module does
not depend on the connection to a robot.
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
        radius_m: meters from the robot's center to the farthest point of its outline.
        speed_m_s: the robot's greatest speed.
        turn_rad_s: the robot's greatest rate of turning.
    """

    radius_m: ClassVar[float]
    speed_m_s: ClassVar[float]
    turn_rad_s: ClassVar[float]

    @abstractmethod
    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity until the next command: forward in m/s, counter-clockwise in rad/s."""


class Omnidrive(Steering):
    """A robot that drives in every direction on the floor, and turns."""

    @abstractmethod
    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the velocity until the next command: forward, left (m/s) and counter-clockwise (rad/s)."""

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity without motion to the side, until the next command."""
        self.drive(forward, 0.0, turn)

    def move(self, movement: Movement) -> None:
        """Drive at the speeds of `movement` until the next command."""
        self.drive(*movement.twist)


class Localization(ABC):
    """A robot that can return its pose."""

    @abstractmethod
    def pose(self) -> Pose:
        """Return the true pose in a simulation; on a real robot, return the odometry, which drifts."""


class Distances(ABC):
    """A robot with distance sensors on its outline.

    Attributes:
        bearings_rad: the direction of each sensor, counter-clockwise from forward.
        distance_range_m: smallest and greatest distance that the sensors measure; for other distances they
            return the nearer bound.
    """

    bearings_rad: ClassVar[tuple[float, ...]]
    distance_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def distances(self) -> NDArray[np.float32]:
        """Return the meters to the nearest obstacle in each direction of `bearings_rad`."""


class Bumper(ABC):
    """A robot with a bumper."""

    @abstractmethod
    def bumped(self) -> bool:
        """Return whether the bumper touches something."""


class Cameras(ABC):
    """A robot with a color camera, a depth camera, or both."""

    @abstractmethod
    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Make the chosen cameras render an image in each `advance` from now on.

        A camera that is not in use does not slow the simulation.

        Raises:
            NoSuchSensor: the robot lacks a chosen camera. A simulated robot that is not connected yet raises
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
        """Return the distance of each pixel in meters, shape (height, width); valid until the next `advance`.

        Distances are measured parallel to the optical axis. Pixels without an object in range are infinite.

        Raises:
            NoSuchSensor: no depth camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """


class Scanner(ABC):
    """A robot with a laser scanner of one layer.

    Attributes:
        scan_view_rad: the angle that the scanner covers, with forward in its middle.
        scan_range_m: smallest and greatest distance that the scanner measures; for other distances it returns
            the nearer bound.
    """

    scan_view_rad: ClassVar[float]
    scan_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_scanner(self) -> None:
        """Make the scanner measure in each `advance` from now on.

        A scanner that is not in use does not slow the simulation.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def scan(self) -> NDArray[np.float32]:
        """Return the distance of each ray in meters, shape (rays,), counter-clockwise from the rightmost ray.

        Raises:
            NoSuchSensor: the scanner is not in use.
            NoReading: no period has passed since `use_scanner`.
        """


class Joints(ABC):
    """A robot with joints, motors that move them, and sensors that measure them.

    Attributes:
        motors: names of the robot's motors.
        sensors: names of the sensors of the robot's joints.
        greatest: the greatest command of each motor, in the unit of `command`.
    """

    motors: ClassVar[tuple[str, ...]]
    sensors: ClassVar[tuple[str, ...]]
    greatest: ClassVar[tuple[float, ...]]

    @abstractmethod
    def joints(self) -> NDArray[np.float64]:
        """Return the readings of `sensors`, shape (sensors,), in radians, meters, or their rates."""

    @abstractmethod
    def command(self, values: Iterable[float]) -> None:
        """Set each motor's force, torque, velocity or position until the next command."""


class Gripper(ABC):
    """A robot with a gripper."""

    @abstractmethod
    def use_gripper(self) -> None:
        """Start to use the gripper's motors; motors that are not in use do not slow the simulation.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def grip(self, opening: float) -> None:
        """Open the gripper in the next period to a share of its width, from 0 (closed) to 1."""


class Forklift(ABC):
    """A robot with a fork that it can lift.

    Attributes:
        lift_range_m: least and greatest height of the fork.
    """

    lift_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_forklift(self) -> None:
        """Start to use the fork's motor; a motor that is not in use does not slow the simulation.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def lift(self, height_m: float) -> None:
        """Move the fork in the next period to a height in `lift_range_m`."""


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
    """Check that a robot has every capability in `needs`; `by` names the task in the error.

    Raises:
        MissingCapability: the robot lacks a capability.
    """
    if missing := [need.__name__ for need in needs if not isinstance(robot, need)]:
        has = [known.__name__ for known in CAPABILITIES if isinstance(robot, known)]
        raise MissingCapability(
            f"trainer.robot: {type(robot).__name__} has no {' and no '.join(missing)}, which {by} needs; "
            f"it has {', '.join(has) or 'no capability'}. Use another robot or another task"
        )
