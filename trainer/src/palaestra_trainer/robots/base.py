"""What every Robotino can do, whether it is simulated, faked or stands in a laboratory.

An environment is written against `RobotinoAbc` alone. What only a simulation can
do, putting things where an episode wants them, is apart in `Scene`: a real robot
has none. Nothing here knows how a robot is reached.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor

RADIUS_M = 0.2266  # of the body's cylinder, as in Webots' model of the Robotino 3
SENSORS = 9  # infrared, one every 40 degrees
# Both ends are what it says beyond them. Source: lookup table of the GP2Y0A41 in that model.
SENSOR_RANGE_M = (0.03, 0.40)
SPEED_M_S = 0.5  # Source: ~max_linear_vel as launched by robotino_node
TURN_RAD_S = 1.0  # Source: default of ~max_angular_vel in robotino_node

Twist = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Pose:
    """Where a robot is: meters in the world's frame, heading in (-pi, pi], 0 along x."""

    x_m: float
    y_m: float
    heading_rad: float


class Movement(IntEnum):
    """The movements of a robot for one control period."""

    STOP = 0
    FORWARD = 1
    BACKWARD = 2
    LEFT = 3
    RIGHT = 4
    TURN_LEFT = 5
    TURN_RIGHT = 6

    @property
    def twist(self) -> Twist:
        """Forward and left in m/s, counter-clockwise in rad/s, as `RobotinoAbc.drive` takes it."""
        return _TWISTS[self]


_TWISTS: dict[Movement, Twist] = {
    Movement.STOP: (0.0, 0.0, 0.0),
    Movement.FORWARD: (SPEED_M_S, 0.0, 0.0),
    Movement.BACKWARD: (-SPEED_M_S, 0.0, 0.0),
    Movement.LEFT: (0.0, SPEED_M_S, 0.0),
    Movement.RIGHT: (0.0, -SPEED_M_S, 0.0),
    Movement.TURN_LEFT: (0.0, 0.0, TURN_RAD_S),
    Movement.TURN_RIGHT: (0.0, 0.0, -TURN_RAD_S),
}


class RobotinoAbc(ABC):
    """A Robotino. Any call may raise `SimulatorFault` where a simulator is behind it.

    Readings change in `advance` only: between two calls all of them describe the same moment. Before the
    first there are none: `distances` and `bumped` raise `NoReading`.
    """

    @property
    @abstractmethod
    def period_s(self) -> float:
        """Seconds that pass in one `advance`; constant."""

    @abstractmethod
    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (9,), in `SENSOR_RANGE_M`.

        The first looks forward, the others follow counter-clockwise every 40 degrees.
        """

    @abstractmethod
    def bumped(self) -> bool:
        """Return whether the bumper touches something."""

    @abstractmethod
    def pose(self) -> Pose:
        """Return the true pose in a simulation, odometry (which drifts) on a real robot."""

    @abstractmethod
    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the wanted velocity: forward, left (m/s) and counter-clockwise (rad/s), until changed."""

    @abstractmethod
    def advance(self) -> int:
        """Let one control period pass; return how many extra ones had to (0 when all is well)."""

    def __deepcopy__(self, memo: dict[int, Any]) -> Self:
        """Return itself: a copy would drive the same robot.

        gymnasium copies the arguments of an environment.
        """
        del memo
        return self

    def move(self, movement: Movement) -> None:
        """Drive at the speeds of `movement` until the next command."""
        self.drive(*movement.twist)

    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Let the chosen cameras have an image from the next `advance` on; they stay in use.

        A camera that is not in use costs nothing.

        Raises:
            NoSuchSensor: the robot lacks one of them. A simulated robot that is not connected yet raises
                `WorldMisfit` when it connects.
        """
        for wanted, name in ((color, "color"), (depth, "depth")):
            if wanted:
                raise self._no_camera(name)

    def color_image(self) -> NDArray[np.uint8]:
        """Return what the camera sees, shape (height, width, 3), RGB; valid until the next `advance`.

        Raises:
            NoSuchSensor: no color camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """
        raise self._no_camera("color")

    def depth_image(self) -> NDArray[np.float32]:
        """Return meters for each pixel, shape (height, width); valid until the next `advance`.

        Meters are along the line of sight of the image's middle; infinite where nothing is in range.

        Raises:
            NoSuchSensor: no depth camera is in use.
            NoReading: no period has passed since `use_cameras`.
        """
        raise self._no_camera("depth")

    def _no_camera(self, name: str) -> NoSuchSensor:
        return NoSuchSensor(f"{type(self).__name__} has no {name} camera; use distances()")


class Scene(Protocol):
    """What can be arranged in a simulation, and nowhere else."""

    def reset(self, seed: int, start: Pose, target: tuple[float, float]) -> None:
        """Begin anew: robot at rest at `start`, mark at `target` (x, y in meters), fresh readings.

        All chance until the next reset follows from `seed`, in [0, 2**31).
        """
        ...
