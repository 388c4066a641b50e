"""The simulated Robotino, which implements `RobotinoAbc` with devices of Webots."""

from __future__ import annotations

import math
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.base import RobotinoAbc
from palaestra_trainer.robots.capabilities import Cameras, Forklift, Gripper, Scanner
from palaestra_trainer.robots.infrared import meters
from palaestra_trainer.robots.lidar_scan import scan_of
from palaestra_trainer.robots.simulated import MobileRobot
from palaestra_trainer.webots import (
    Camera,
    DistanceSensor,
    JointMotor,
    Lidar,
    Motor,
    RangeFinder,
    TouchSensor,
    set_velocities,
)

# Source: projects/robots/festo/robotino3 of Webots R2023b.
_WHEEL_RADIUS_M = 0.063
_WHEEL_DISTANCE_M = 0.1826
_SIN_60 = math.sqrt(0.75)
_Speed = TypeVar("_Speed", float, NDArray[np.float64])


class Robotino(MobileRobot, RobotinoAbc, Cameras, Scanner, Gripper, Forklift):
    """A Robotino in Webots, or in any simulator with the same ROS interface.

    Cameras, laser scanner, gripper and forklift are optional. The world may lack these devices, which do not
    slow the simulation until they are used. The arguments are those of `SimulatedRobot`.

    Attributes:
        wheels: names of the wheels' motors: rear, front right, front left.
        infrared: names of the robot's distance sensors, counter-clockwise from the front.
        bumper: name of the robot's touch sensor.
        color_camera: name of the robot's Camera.
        depth_camera: name of the robot's RangeFinder.
        laser: name of the robot's Lidar.
        fingers: names of the gripper's linear motors; at position 0 the gripper is closed.
        grip_m: position of the fingers when the gripper is open.
        fork: name of the fork's linear motor.
    """

    definition = "ROBOTINO"
    wheels: ClassVar[tuple[str, str, str]] = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
    infrared: ClassVar[tuple[str, ...]] = tuple(f"ir{number + 1}" for number in range(9))
    bumper: ClassVar[str] = "touch sensor"
    color_camera: ClassVar[str] = "camera"
    depth_camera: ClassVar[str] = "depth camera"
    laser: ClassVar[str] = "laser"
    fingers: ClassVar[tuple[str, ...]] = ("gripper left", "gripper right")
    grip_m: ClassVar[float] = 0.03
    fork: ClassVar[str] = "fork"
    lift_range_m: ClassVar[tuple[float, float]] = (0.0, 0.15)
    # Source: scan0 of a Robotino 4 with the laser scanner of Festo.
    scan_view_rad: ClassVar[float] = math.radians(220.0)
    scan_range_m: ClassVar[tuple[float, float]] = (0.02, 20.0)

    def equip(self) -> None:
        """Add the wheels, the distance sensors and the bumper; other devices are added on first use."""
        name = self.node_name
        self._wheels = tuple(Motor(name, wheel) for wheel in self.wheels)
        self._infrared = tuple(DistanceSensor(name, sensor) for sensor in self.infrared)
        self._bumper = TouchSensor(name, self.bumper)
        self._camera = Camera(name, self.color_camera)
        self._depth_camera = RangeFinder(name, self.depth_camera)
        self._laser = Lidar(name, self.laser)
        self._fingers = tuple(JointMotor(name, finger, "position") for finger in self.fingers)
        self._fork = JointMotor(name, self.fork, "position")
        self.simulation.add((*self._infrared, self._bumper), self._wheels)

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (9,), counter-clockwise from forward."""
        volts = [sensor.value for sensor in self._infrared]
        if None in volts:
            raise self._no_reading()
        return np.array([meters(volt) for volt in volts], dtype=np.float32)

    def bumped(self) -> bool:
        """Return whether the bumper touches something."""
        if self._bumper.value is None:
            raise self._no_reading()
        return bool(self._bumper.value)

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the velocity until the next command: forward, left (m/s) and counter-clockwise (rad/s)."""
        set_velocities(zip(self._wheels, wheel_speeds(vx, vy, omega), strict=True))

    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Enable the Camera, the RangeFinder, or both; they stay enabled.

        Raises:
            NoSuchSensor: the connected robot lacks a chosen camera, or the simulator does not render images.
            SimulatorDead, SimulatorHung, WrongData
        """
        if color:
            self._use(self._camera)
        if depth:
            self._use(self._depth_camera)

    def color_image(self) -> NDArray[np.uint8]:
        """Return a view of the camera's RGB image, shape (height, width, 3), valid until the next step."""
        self._require_use(self._camera, "color camera", "use_cameras(color=True)")
        return self._camera.rgb

    def depth_image(self) -> NDArray[np.float32]:
        """Return a view of the meters for each pixel, shape (height, width), valid until the next step."""
        self._require_use(self._depth_camera, "depth camera", "use_cameras(depth=True)")
        return self._depth_camera.depths

    def use_scanner(self) -> None:
        """Enable the Lidar; it stays enabled."""
        self._use(self._laser)

    def scan(self) -> NDArray[np.float32]:
        """Return a new array of distances in meters, counter-clockwise from the rightmost ray."""
        self._require_use(self._laser, "scanner", "use_scanner()")
        if self._laser.value is None:
            raise self._no_reading()
        return scan_of(self._laser.value, self.scan_range_m)

    def use_gripper(self) -> None:
        """Start to use the gripper's motors, which close the gripper."""
        self._use(*self._fingers)

    def grip(self, opening: float) -> None:
        """Open the gripper in the next period to a share of its width, from 0 (closed) to 1."""
        for finger in self._fingers:
            self._require_use(finger, "gripper", "use_gripper()")
            finger.set(self.grip_m * min(max(opening, 0.0), 1.0))

    def use_forklift(self) -> None:
        """Start to use the fork's motor, which lowers the fork."""
        self._use(self._fork)

    def lift(self, height_m: float) -> None:
        """Move the fork in the next period to a height in `lift_range_m`."""
        self._require_use(self._fork, "fork", "use_forklift()")
        least, most = self.lift_range_m
        self._fork.set(min(max(height_m, least), most))


def wheel_speeds(vx: _Speed, vy: _Speed, omega: _Speed) -> tuple[_Speed, _Speed, _Speed]:
    """Return the speeds (rad/s) of rear, front-right and front-left wheel for a twist in m/s and rad/s.

    The arguments are numbers, or arrays of one shape.
    """
    turn = omega * _WHEEL_DISTANCE_M
    return (
        (vy - turn) / _WHEEL_RADIUS_M,
        (-_SIN_60 * vx - 0.5 * vy - turn) / _WHEEL_RADIUS_M,
        (_SIN_60 * vx - 0.5 * vy - turn) / _WHEEL_RADIUS_M,
    )
