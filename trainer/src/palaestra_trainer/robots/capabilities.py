"""The abilities of robots, one class each, and the refusal of a robot that lacks one.

A robot inherits each capability that it has. An environment lists in `needs` those without which its task
makes no sense. So a task names no robot and a robot names no task, and a pair that does not fit is refused
before a simulator starts. Readings change in `RobotAbc.advance` only: between two calls all of them describe
the same moment. Nothing here knows how a robot is reached.
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
    """Driving forward and turning.

    Attributes:
        radius_m: from its center to the farthest point of its outline.
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
    """Driving in every direction of the floor, and turning."""

    @abstractmethod
    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the wanted velocity: forward, left (m/s) and counter-clockwise (rad/s), until changed."""

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity, without motion to the side."""
        self.drive(forward, 0.0, turn)

    def move(self, movement: Movement) -> None:
        """Drive at the speeds of `movement` until the next command."""
        self.drive(*movement.twist)


class Localization(ABC):
    """Knowing where it is."""

    @abstractmethod
    def pose(self) -> Pose:
        """Return the true pose in a simulation, odometry (which drifts) on a real robot."""


class Distances(ABC):
    """Distance sensors on its outline.

    Attributes:
        bearings_rad: the direction of each sensor, counter-clockwise from forward.
        distance_range_m: least and most that they measure; what is beyond counts as the nearer end.
    """

    bearings_rad: ClassVar[tuple[float, ...]]
    distance_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, one number for each of `bearings_rad`."""


class Bumper(ABC):
    """Feeling a contact."""

    @abstractmethod
    def bumped(self) -> bool:
        """Return whether the bumper touches something."""


class Cameras(ABC):
    """A color camera, a depth camera, or both."""

    @abstractmethod
    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Let the chosen cameras have an image from the next `advance` on; they stay in use.

        A camera that is not in use costs nothing.

        Raises:
            NoSuchSensor: the robot lacks one of them. A simulated robot that is not connected yet raises
                `WorldMisfit` when it connects.
        """

    @abstractmethod
    def color_image(self) -> NDArray[np.uint8]:
        """Return what the camera sees, shape (height, width, 3), RGB; valid until the next `advance`.

        Raises:
            NoSuchSensor: no color camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """

    @abstractmethod
    def depth_image(self) -> NDArray[np.float32]:
        """Return meters for each pixel, shape (height, width); valid until the next `advance`.

        Meters are along the line of sight of the image's middle; infinite where nothing is in range.

        Raises:
            NoSuchSensor: no depth camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """


class Scanner(ABC):
    """A laser scanner of one layer.

    Attributes:
        scan_view_rad: the angle that it covers, half of it on either side of forward.
        scan_range_m: least and most that it measures; what is beyond counts as the nearer end.
    """

    scan_view_rad: ClassVar[float]
    scan_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_scanner(self) -> None:
        """Let the scanner have a scan from the next `advance` on; it stays in use.

        A scanner that is not in use costs nothing.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def scan(self) -> NDArray[np.float32]:
        """Return meters from the scanner, shape (rays,), from the rightmost ray counter-clockwise.

        Raises:
            NoSuchSensor: the scanner is not in use.
            NoReading: no period has passed since `use_scanner`.
        """


class Joints(ABC):
    """Joints that it moves and measures.

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
    """Holding something."""

    @abstractmethod
    def use_gripper(self) -> None:
        """Take hold of the gripper's motors; without it they cost nothing.

        Raises:
            NoSuchSensor: as `Cameras.use_cameras`.
        """

    @abstractmethod
    def grip(self, opening: float) -> None:
        """Open the gripper to a share of its width, from 0 (closed) to 1, from the next period on."""


class Forklift(ABC):
    """Lifting something.

    Attributes:
        lift_range_m: least and greatest height of the fork.
    """

    lift_range_m: ClassVar[tuple[float, float]]

    @abstractmethod
    def use_forklift(self) -> None:
        """Take hold of the fork's motor; without it the fork costs nothing.

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
    """Return if a robot has every capability in `needs`; `by` is the name of the task in the error.

    Raises:
        MissingCapability: it lacks some.
    """
    if missing := [need.__name__ for need in needs if not isinstance(robot, need)]:
        has = [known.__name__ for known in CAPABILITIES if isinstance(robot, known)]
        raise MissingCapability(
            f"trainer.robot: {type(robot).__name__} has no {' and no '.join(missing)}, which {by} needs; "
            f"it has {', '.join(has) or 'no capability'}. Use a robot or a task that fits the other"
        )
