"""Simulated robots with two driven wheels."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.capabilities import Distances, Scanner, Steering
from palaestra_trainer.robots.lidar_scan import scan_of
from palaestra_trainer.robots.simulated import MobileRobot
from palaestra_trainer.webots import DistanceSensor, Lidar, Motor, set_velocities


class DifferentialDrive(MobileRobot, Steering):
    """A robot with two driven wheels on one axle; the arguments are those of `SimulatedRobot`.

    A subclass sets the DEF name of its robot, and the names and sizes of its wheels.

    Attributes:
        wheels: names of the motors of the left and the right wheel.
        wheel_radius_m: radius of each wheel.
        axle_m: distance between the wheels.
        wheel_rad_s: the greatest speed of a wheel.
    """

    wheels: ClassVar[tuple[str, str]] = ("left wheel motor", "right wheel motor")
    wheel_radius_m: ClassVar[float]
    axle_m: ClassVar[float]
    wheel_rad_s: ClassVar[float]

    def equip(self) -> None:
        """Add the wheels."""
        self._wheels = tuple(Motor(self.node_name, wheel) for wheel in self.wheels)
        self.simulation.add((), self._wheels)

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity until the next command: forward in m/s, counter-clockwise in rad/s.

        If a wheel would exceed its greatest speed, both wheels turn slower by the same factor, so the robot
        drives the same curve.
        """
        side = 0.5 * turn * self.axle_m
        wanted = (forward - side) / self.wheel_radius_m, (forward + side) / self.wheel_radius_m
        slower = min(1.0, self.wheel_rad_s / max(*map(abs, wanted), self.wheel_rad_s))
        set_velocities(zip(self._wheels, (slower * speed for speed in wanted), strict=True))


class TurtleBot3Burger(DifferentialDrive, Scanner):
    """The TurtleBot3 Burger of Robotis, with its laser scanner.

    Attributes:
        laser: name of the robot's Lidar.
    """

    definition = "BURGER"
    # Source: TurtleBot3Burger and RobotisLds01 of Webots.
    wheel_radius_m = 0.033
    axle_m = 0.16
    wheel_rad_s = 6.67
    radius_m = 0.111  # from the middle of the axle to the corners at the rear
    speed_m_s = 0.22
    turn_rad_s = 2.75
    laser: ClassVar[str] = "LDS-01"
    scan_view_rad = 2.0 * math.pi
    scan_range_m = (0.12, 3.5)

    def equip(self) -> None:
        """Add the wheels; the scanner is added on first use."""
        super().equip()
        self._laser = Lidar(self.node_name, self.laser)

    def use_scanner(self) -> None:
        """Enable the Lidar; it stays enabled."""
        self._use(self._laser)

    def scan(self) -> NDArray[np.float32]:
        """Return a new array of distances in meters, shape (360,), counter-clockwise from behind.

        The scanner does not detect an object nearer than 0.12 m. The ray toward such an object measures the
        greatest distance.
        """
        self._require_use(self._laser, "scanner", "use_scanner()")
        if self._laser.value is None:
            raise self._no_reading()
        return scan_of(self._laser.value, self.scan_range_m)


class EPuck(DifferentialDrive, Distances):
    """The e-puck of GCtronic, with its eight infrared sensors.

    Attributes:
        infrared: names of the robot's distance sensors, counter-clockwise from the front.
    """

    definition = "EPUCK"
    # Source: E-puck of Webots.
    wheel_radius_m = 0.02
    axle_m = 0.052
    wheel_rad_s = 6.28
    radius_m = 0.037
    speed_m_s = 0.125
    turn_rad_s = 4.8
    infrared: ClassVar[tuple[str, ...]] = ("ps7", "ps6", "ps5", "ps4", "ps3", "ps2", "ps1", "ps0")
    bearings_rad = tuple(
        math.radians(angle) for angle in (17.1, 45.8, 90.0, 151.2, 208.5, 270.0, 314.1, 342.8)
    )
    distance_range_m = (0.0, 0.07)

    def equip(self) -> None:
        """Add the wheels and the distance sensors."""
        super().equip()
        self._infrared = tuple(DistanceSensor(self.node_name, sensor) for sensor in self.infrared)
        self.simulation.add(self._infrared, ())

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (8,), counter-clockwise from the front left."""
        counts = [sensor.value for sensor in self._infrared]
        if None in counts:
            raise self._no_reading()
        return np.array(np.interp(counts, _COUNTS, _METERS), np.float32)


# The lookup table of the e-puck's distance sensors. Source: E-puckDistanceSensor of Webots R2022a.
_METERS = (0.07, 0.06, 0.05, 0.04, 0.03, 0.02, 0.015, 0.01, 0.005, 0.0)
_COUNTS = (67.19, 104.09, 120.0, 158.03, 234.93, 383.84, 601.46, 1465.73, 2133.33, 4095.0)
