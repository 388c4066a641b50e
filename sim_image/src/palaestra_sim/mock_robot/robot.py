"""One mock robot: a Robotino in a scene of the stub, with its base, its odometry and its sensors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from random import Random
from threading import Lock
from typing import Final, NamedTuple

from palaestra_sim.errors import SimError
from palaestra_sim.mock_robot.base import BaseFirmware, approach
from palaestra_sim.mock_robot.infrared import OUT_OF_RANGE_M, distance_m
from palaestra_sim.mock_robot.odometry import DriftingOdometry, Reading
from palaestra_sim.scene.bodies import Body
from palaestra_sim.scene.devices.distance_sensor import DistanceSensor
from palaestra_sim.scene.devices.touch_sensor import TouchSensor
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mobile_base import MobileBase
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.motors import Motor
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.wheel_kinematics import Twist
from palaestra_sim.stub.physics import StubPhysics

WHEELS: Final = ("wheel0_joint", "wheel1_joint", "wheel2_joint")
INFRARED: Final = tuple(f"ir{number}" for number in range(1, 10))  # counter-clockwise from the front
BUMPER: Final = "touch sensor"
_AT_REST: Final = (0.0, 0.0, 0.0)


class MockRobotError(SimError, ValueError):
    """A mock robot cannot do what was requested; the message has the reason and a remedy."""


class Truth(NamedTuple):
    """The state of the robot in its world.

    Attributes:
        x, y, heading: the pose in the world, in m and rad.
        vx, vy, omega: the motion over the last step in the robot's axes, in m/s and rad/s.
        time_s: the robot time of the last step.
        contacts: the number of times that the bumper was hit.
        commands: the number of commands that have arrived.
        last_command_s: the robot time of the last command, at most one step after `time_s`; None before the
            first command.
    """

    x: float
    y: float
    heading: float
    vx: float
    vy: float
    omega: float
    time_s: float
    contacts: int
    commands: int
    last_command_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Habits:
    """The errors of a robot's sensors.

    Attributes:
        drift: the argument `drift` of `DriftingOdometry`.
        noise_m: standard deviation of the distances, in addition to the noise of the world.
        seed: the seed of all random numbers.
    """

    drift: float = 0.02
    noise_m: float = 0.0
    seed: int = 0


class MockRobot:
    """A robot that several threads may use; only `advance` moves it.

    Args:
        world: the file of a world with a Robotino.
        habits: the errors of the sensors.

    Attributes:
        step_ms: WorldInfo.basicTimeStep of the world.
        charging: whether the charger is connected.

    Raises:
        WorldError: the world is wrong, or contains an object that cannot be simulated.
        MockRobotError: the world has no Robotino.
        OSError: the world cannot be read.
    """

    def __init__(self, world: Path, habits: Habits) -> None:
        self._lock = Lock()
        self._simulation = Loader(physics=StubPhysics)(world, Mode.REAL_TIME)
        self._devices = _devices(self._simulation, world.name)
        self._base = BaseFirmware()
        self._random = Random(habits.seed)
        self._odometry = DriftingOdometry(habits.drift, self._random)
        self._noise_m = habits.noise_m
        self._bumped = False
        self._contacts = 0
        self._distances_m: list[float] = []
        self._step_s = self._simulation.basic_step_ms / 1000.0
        self.step_ms = self._simulation.basic_step_ms
        self.charging = False
        for wheel in self._devices.wheels:
            wheel.set_position(math.inf)
            wheel.set_velocity(0.0)
        self.advance(self.step_ms)  # the sensors have no values before the first step

    @property
    def time_s(self) -> float:
        """The robot time of the last step."""
        return self._simulation.time_ms / 1000.0

    def advance(self, duration_ms: int) -> None:
        """Let robot time pass.

        Raises:
            ValueError: the duration is not a positive multiple of `step_ms`.
        """
        count, rest = divmod(duration_ms, self.step_ms)
        if rest or count < 1:
            raise ValueError(f"{duration_ms} ms is not a positive multiple of {self.step_ms} ms")
        for _ in range(count):
            with self._lock:
                self._step()

    def command(self, velocity: Twist, now_s: float) -> None:
        """Command vx, vy in m/s and omega in rad/s, in the robot's axes; `now_s` is robot time."""
        with self._lock:
            self._base.command(velocity, now_s)

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Carry the robot to another place, as a person does; the odometry does not change.

        Raises:
            MockRobotError: an obstacle is there; the robot stays where it is.
        """
        with self._lock:
            body, node = self._devices.body, self._devices.robot.parts.node
            before = (body.x, body.y, body.heading_rad)
            body.place(x, y, math.remainder(heading_rad, 2.0 * math.pi))
            if self._simulation.contact_points(node, descendants=True):
                body.place(*before)
                raise MockRobotError(f"x {x:g}, y {y:g}: an obstacle is there; choose a free place")
            self._bumped = False
            self._simulation.sample()
            self._distances_m = []

    def odometry(self) -> Reading:
        """Return the current values of the odometry."""
        with self._lock:
            return self._odometry.reading

    def bumped(self) -> bool:
        """Return whether the bumper is pressed; it stays pressed while the robot rests at an obstacle."""
        return self._bumped

    def distances_m(self) -> list[float]:
        """Return the distances in meters, counter-clockwise from the front; `OUT_OF_RANGE_M`: no obstacle."""
        with self._lock:
            if not self._distances_m:
                self._distances_m = [self._measured(sensor) for sensor in self._devices.infrared]
            return self._distances_m

    def truth(self) -> Truth:
        """Return the state of the robot in its world."""
        with self._lock:
            body, base = self._devices.body, self._base
            vx, vy, omega = body.velocity
            # The velocity is an average over the step, so its axes are those in the middle of the step.
            middle = body.heading_rad - 0.5 * omega * self._step_s
            c, s = math.cos(middle), math.sin(middle)
            return Truth(
                x=body.x,
                y=body.y,
                heading=body.heading_rad,
                vx=vx * c + vy * s,
                vy=vy * c - vx * s,
                omega=omega,
                time_s=self.time_s,
                contacts=self._contacts,
                commands=base.commands,
                last_command_s=base.last_command_s,
            )

    def _step(self) -> None:
        devices = self._devices
        drive = devices.base
        current = (drive.vx, drive.vy, drive.omega)
        velocity = approach(current, self._base.target(self.time_s), self._step_s)
        devices.turn_wheels(velocity)
        self._simulation.step(self.step_ms)
        self._odometry.advance((drive.vx, drive.vy, drive.omega), self._step_s)
        hit = bool(devices.bumper.value)
        self._contacts += hit and not self._bumped
        self._bumped = hit or (self._bumped and devices.body.velocity == _AT_REST)
        self._distances_m = []

    def _measured(self, sensor: DistanceSensor) -> float:
        measured_m = distance_m(sensor.table.rows, sensor.value)
        if measured_m == OUT_OF_RANGE_M or not self._noise_m:
            return measured_m
        return max(0.0, measured_m + self._random.gauss(0.0, self._noise_m))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Devices:
    """The Robotino's parts in the scene."""

    robot: Robot
    body: Body
    base: MobileBase
    wheels: tuple[Motor, ...]
    infrared: tuple[DistanceSensor, ...]
    bumper: TouchSensor

    def turn_wheels(self, velocity: Twist) -> None:
        """Set the motors to the speeds at which the robot has this velocity."""
        assert self.base.drive is not None  # `_devices` has checked the wheels
        for wheel, speed in zip(self.wheels, self.base.drive.wheel_speeds(*velocity), strict=True):
            wheel.set_velocity(speed)


def _devices(simulation: Simulation, world: str) -> _Devices:
    """Return the first Robotino of a world.

    Raises:
        MockRobotError: no robot has all devices of a Robotino.
    """
    lacks = "it has no robot"
    for robot in simulation.robots:
        body = robot.body
        wheels = () if body is None else tuple(it for it in robot.motors.values() if body.base.has(it))
        infrared = [robot.sensors.get(name) for name in INFRARED]
        bumper = robot.sensors.get(BUMPER)
        if body is None or sorted(it.name for it in wheels) != sorted(WHEELS):
            lacks = f'the robot "{robot.name}" does not drive on the wheels {", ".join(WHEELS)}'
        elif not isinstance(bumper, TouchSensor) or not all(
            isinstance(it, DistanceSensor) for it in infrared
        ):
            lacks = f'the robot "{robot.name}" lacks one of the sensors "{BUMPER}", {", ".join(INFRARED)}'
        else:
            return _Devices(
                robot=robot,
                body=body,
                base=body.base,
                wheels=wheels,
                infrared=tuple(it for it in infrared if isinstance(it, DistanceSensor)),
                bumper=bumper,
            )
    raise MockRobotError(f"{world}: {lacks}; use a world with a Robotino, such as arena")
