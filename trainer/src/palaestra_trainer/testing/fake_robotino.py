"""A fake Robotino in the arena, computed in this process.

`fake_arena()` returns a robot and a scene for `MoveToTargetEnv`, with some twenty thousand steps per second,
for notebooks, tests and experiments with rewards. `fake_seeing()` returns a robot with cameras and a scene
for `SeeTarget`. The fake computes only the physics that the task needs. The robot accelerates over some time,
walls and cylinders stop it and let it slide, and its infrared sensors have a range of 40 cm. The robot can
crash at given steps, as simulators may do.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor
from palaestra_trainer.robots.base import RADIUS_M, SENSOR_RANGE_M, SENSORS, RobotinoAbc
from palaestra_trainer.robots.capabilities import Cameras
from palaestra_trainer.robots.geometry import Point, Pose, Twist
from palaestra_trainer.robots.layout import FloorLayout
from palaestra_trainer.testing.crashing import Crashing
from palaestra_trainer.testing.fake_camera import look
from palaestra_trainer.testing.fake_scene import (
    CYLINDER_RADIUS_M,
    CYLINDERS,
    HALF_SIDE_M,
    STORED_M,
    FakeScene,
    arena,
)

BASIC_STEP_S = 0.032
BASIC_STEPS = 6  # number of basic steps in one control period
ACCELERATIONS = (10.0, 6.0, 20.0)  # m/s2, m/s2, rad/s2. Source: Webots, robotino3/base.c
# Standard deviation as a share of the reading. Source: GP2Y0A41 in Webots' model of the Robotino 3.
NOISE = 0.005


class FakeRobotino(Crashing, RobotinoAbc):
    """A fake Robotino on the floor of the arena.

    Args:
        deaths: numbers of the `advance` calls at which the robot crashes, counted from 1; a restart does not
            reset the count. After a crash, every call raises `SimulatorDead` until `restart`.
        name: name of the robot in faults.

    Attributes:
        cylinders: x, y in meters of the cylinders that stand on the floor.
        target: x, y in meters of the mark; cameras see a pole there.
    """

    def __init__(self, deaths: Collection[int] = (), name: str = "fake") -> None:
        super().__init__(deaths, name)
        self.cylinders: Sequence[Point] = ()
        self.layout = arena()
        self.target: Point = (0.0, 0.0)
        self._wanted: Twist
        self._velocity: Twist
        self.place(Pose(0.0, 0.0, 0.0), seed=0)

    @property
    def period_s(self) -> float:
        """The duration of six basic steps of 32 ms, as in the shipped example."""
        return BASIC_STEP_S * BASIC_STEPS

    @property
    def layout(self) -> FloorLayout:
        """The arena with its obstacles; the fake simulates only the cylinders."""
        return self._layout

    @layout.setter
    def layout(self, layout: FloorLayout) -> None:
        self._layout = layout
        self.cylinders = tuple((thing.x_m, thing.y_m) for thing in layout.obstacles if thing.standing)

    def distances(self) -> NDArray[np.float32]:
        """Return the readings of the nine distance sensors after the last step."""
        self._live()
        return self._distances.copy()

    def bumped(self) -> bool:
        """Return whether the robot touched something in the last step."""
        self._live()
        return self._bumped

    def pose(self) -> Pose:
        """Return the pose after the last step."""
        self._live()
        return Pose(self._x_m, self._y_m, self._heading_rad)

    def drive(self, vx: float, vy: float, omega: float) -> None:
        """Set the wanted velocity."""
        self._live()
        self._wanted = (vx, vy, omega)

    def advance(self) -> int:
        """Simulate one control period; return 0, because the fake never needs extra periods."""
        self._live_a_step()
        self._bumped = False
        for _ in range(BASIC_STEPS):
            self._speed_up()
            self._roll()
            self._slide()
        self._sense()
        return 0

    def place(self, pose: Pose, seed: int) -> None:
        """Put the robot at `pose`, at rest, and update all readings; `seed` decides the noise."""
        self._live()
        self._x_m, self._y_m, self._heading_rad = pose.x_m, pose.y_m, pose.heading_rad
        self._wanted = self._velocity = (0.0, 0.0, 0.0)
        self._bumped = False
        self._random = np.random.default_rng(seed)
        self._sense()

    def _speed_up(self) -> None:
        vx, vy, omega = (
            was + max(-limit * BASIC_STEP_S, min(limit * BASIC_STEP_S, wanted - was))
            for was, wanted, limit in zip(self._velocity, self._wanted, ACCELERATIONS, strict=True)
        )
        self._velocity = (vx, vy, omega)

    def _roll(self) -> None:
        vx, vy, omega = self._velocity
        middle = self._heading_rad + 0.5 * omega * BASIC_STEP_S
        self._x_m += (vx * math.cos(middle) - vy * math.sin(middle)) * BASIC_STEP_S
        self._y_m += (vx * math.sin(middle) + vy * math.cos(middle)) * BASIC_STEP_S
        self._heading_rad = wrapped(self._heading_rad + omega * BASIC_STEP_S)

    def _slide(self) -> None:
        """Move the robot out of an obstacle that it hit, so that the robot slides along the obstacle."""
        for x, y in self.cylinders:
            reach = CYLINDER_RADIUS_M + RADIUS_M
            distance = math.hypot(self._x_m - x, self._y_m - y)
            if distance < reach:
                self._x_m = x + (self._x_m - x) * reach / distance
                self._y_m = y + (self._y_m - y) * reach / distance
                self._bumped = True
        limit = HALF_SIDE_M - RADIUS_M
        if max(abs(self._x_m), abs(self._y_m)) > limit:
            self._x_m = max(-limit, min(limit, self._x_m))
            self._y_m = max(-limit, min(limit, self._y_m))
            self._bumped = True

    def _sense(self) -> None:
        seen = [self._ray(self._heading_rad + bearing) for bearing in self.bearings_rad]
        noise = 1.0 + NOISE * self._random.standard_normal(SENSORS)
        self._distances = np.clip(seen * noise, *SENSOR_RANGE_M).astype(np.float32)

    def _ray(self, bearing_rad: float) -> float:
        """Return meters from the robot's body to the nearest obstacle in a direction of the world's frame."""
        ux, uy = math.cos(bearing_rad), math.sin(bearing_rad)
        nearest = min(_to_wall(self._x_m, ux), _to_wall(self._y_m, uy))
        for x, y in self.cylinders:
            along = (x - self._x_m) * ux + (y - self._y_m) * uy
            aside = (x - self._x_m) * uy - (y - self._y_m) * ux
            if along > 0.0 and abs(aside) < CYLINDER_RADIUS_M:
                nearest = min(nearest, along - math.sqrt(CYLINDER_RADIUS_M**2 - aside**2))
        return nearest - RADIUS_M


class FakeSeeingRobotino(FakeRobotino, Cameras):
    """A `FakeRobotino` with a color and a depth camera; see `fake_camera`."""

    def __init__(self, deaths: Collection[int] = (), name: str = "fake") -> None:
        super().__init__(deaths, name)
        self._in_use: set[str] = set()

    def use_cameras(self, *, color: bool = False, depth: bool = False) -> None:
        """Make the chosen cameras render an image in each `advance` from now on."""
        self._live()
        self._in_use |= {name for name, wanted in (("color", color), ("depth", depth)) if wanted}

    def color_image(self) -> NDArray[np.uint8]:
        """Return a new array with the color image at the pose after the last step."""
        return self._look("color")[0]

    def depth_image(self) -> NDArray[np.float32]:
        """Return a new array with the meters for each pixel, at the pose after the last step."""
        return self._look("depth")[1]

    def _look(self, camera: str) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
        self._live()
        if camera not in self._in_use:
            raise NoSuchSensor(
                f"{self._name}: its {camera} camera is not in use; call use_cameras({camera}=True), "
                "then advance()"
            )
        return look(self.pose(), self.target, self.cylinders)


def fake_arena(deaths: Collection[int] = ()) -> tuple[FakeRobotino, FakeScene]:
    """Return a robot and its scene; see `FakeRobotino` for `deaths`."""
    robot = FakeRobotino(deaths)
    return robot, FakeScene(robot)


def fake_seeing(deaths: Collection[int] = ()) -> tuple[FakeSeeingRobotino, FakeScene]:
    """Return a robot with cameras and its scene without cylinders; see `FakeRobotino` for `deaths`.

    The cylinders are stored under the floor, as in the world `seeing`.
    """
    robot = FakeSeeingRobotino(deaths)
    return robot, FakeScene(robot, arena(CYLINDERS, STORED_M))


def wrapped(angle_rad: float) -> float:
    """Return an angle in (-pi, pi] with the same direction."""
    angle_rad = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if angle_rad == -math.pi else angle_rad


def _to_wall(position_m: float, direction: float) -> float:
    if direction == 0.0:
        return math.inf
    return (math.copysign(HALF_SIDE_M, direction) - position_m) / direction
