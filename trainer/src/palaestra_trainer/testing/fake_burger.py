"""A TurtleBot3 Burger on the floor of the world `court`, computed in this process.

`fake_court()` returns a robot and a scene for `NavigateEnv` that run at some thousand steps a second. The
robot drives without slip and at once as commanded; things stop it and let it slide; its scanner has
the rays, the range and the noise of the real one. It can die at given steps, as simulators do.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor
from palaestra_trainer.robots.base import RobotAbc
from palaestra_trainer.robots.capabilities import Localization, Scanner, Steering
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import Layout, Obstacle
from palaestra_trainer.testing.fake_robotino import wrapped
from palaestra_trainer.testing.fake_scene import FakeScene
from palaestra_trainer.testing.mortal import Mortal

PERIOD_S = 0.192
RAYS = 360
SCANNER_M = -0.03  # from the robot's center, along its heading
NOISE_M = 0.015  # 0.0043 of the greatest distance. Source: RobotisLds01 of Webots
AXLE_M, FASTEST_M_S = 0.16, 0.22  # the fastest rim of a wheel
ROWS = (np.arange(RAYS) + 0.5) * (2.0 * math.pi / RAYS) - math.pi
TOP_M = 0.3
_LEAST_SLOPE = 1e-9

COURT = Layout(
    low=(-1.5, -1.5),
    high=(1.5, 1.5),
    obstacles=(
        Obstacle(
            name="BOX_0", x_m=0.7, y_m=0.6, bottom_m=0.0, top_m=TOP_M, half_m=(0.25, 0.1), heading_rad=0.5
        ),
        Obstacle(
            name="BOX_1", x_m=-0.7, y_m=0.5, bottom_m=0.0, top_m=TOP_M, half_m=(0.1, 0.3), heading_rad=-0.3
        ),
        Obstacle(name="CYLINDER_0", x_m=-0.55, y_m=-0.7, bottom_m=0.0, top_m=TOP_M, radius_m=0.2),
        Obstacle(name="CYLINDER_1", x_m=0.6, y_m=-0.6, bottom_m=0.0, top_m=TOP_M, radius_m=0.15),
    ),
)

_Rays = NDArray[np.float64]


class FakeBurger(Mortal, RobotAbc, Steering, Localization, Scanner):
    """A TurtleBot3 Burger, computed here.

    Args:
        deaths: numbers of the `advance` calls, counted from 1 over its whole life, at which it dies; every
            call raises `SimulatorDead` from then until `restart`.
        name: its name in faults.

    Attributes:
        layout: the floor and what stands on it.
        target: x, y in meters of the mark.
    """

    radius_m = 0.111
    speed_m_s = FASTEST_M_S
    turn_rad_s = 2.0 * FASTEST_M_S / AXLE_M
    scan_view_rad = 2.0 * math.pi
    scan_range_m = (0.12, 3.5)

    def __init__(self, deaths: Collection[int] = (), name: str = "fake") -> None:
        super().__init__(deaths, name)
        self.layout = COURT
        self.target: Point = (0.0, 0.0)
        self._heading_rad = 0.0
        self._scans = False
        self.place(Pose(0.0, 0.0, 0.0), seed=0)

    @property
    def period_s(self) -> float:
        """Six basic steps of 32 ms."""
        return PERIOD_S

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity; slower along the same curve if a wheel cannot run so fast."""
        self._live()
        rim = abs(forward) + 0.5 * abs(turn) * AXLE_M
        slower = min(1.0, FASTEST_M_S / max(rim, FASTEST_M_S))
        self._wanted = slower * forward, slower * turn

    def pose(self) -> Pose:
        """Return the pose after the last step."""
        self._live()
        return Pose(self._x_m, self._y_m, self._heading_rad)

    def use_scanner(self) -> None:
        """Let the scanner have a scan."""
        self._scans = True

    def scan(self) -> NDArray[np.float32]:
        """Return meters, shape (360,), from behind counter-clockwise; a new array."""
        self._live()
        if not self._scans:
            raise NoSuchSensor(f"{self._name}: its scanner is not in use; call use_scanner(), then advance()")
        return self._scan.copy()

    def advance(self) -> int:
        """Simulate one control period; there are never extra ones."""
        self._live_a_step()
        forward, turn = self._wanted
        middle = self._heading_rad + 0.5 * turn * PERIOD_S
        self._x_m += forward * math.cos(middle) * PERIOD_S
        self._y_m += forward * math.sin(middle) * PERIOD_S
        self._heading_rad = wrapped(self._heading_rad + turn * PERIOD_S)
        self._slide()
        self._look()
        return 0

    def place(self, pose: Pose, seed: int) -> None:
        """Put the robot at rest at `pose`, with fresh readings; `seed` decides the noise."""
        self._live()
        self._x_m, self._y_m, self._heading_rad = pose.x_m, pose.y_m, pose.heading_rad
        self._wanted = (0.0, 0.0)
        self._random = np.random.default_rng(seed)
        self._look()

    def _slide(self) -> None:
        """Push the robot out of the walls and of the things that it hit."""
        (low_x, low_y), (high_x, high_y) = self.layout.low, self.layout.high
        for thing in self.layout.obstacles:
            inside = self.radius_m - thing.gap(self._x_m, self._y_m)
            if thing.standing and inside > 0.0:
                away = thing.away(self._x_m, self._y_m)
                self._x_m += inside * away[0]
                self._y_m += inside * away[1]
        self._x_m = min(max(self._x_m, low_x + self.radius_m), high_x - self.radius_m)
        self._y_m = min(max(self._y_m, low_y + self.radius_m), high_y - self.radius_m)

    def _look(self) -> None:
        angles = self._heading_rad + ROWS
        way = np.cos(angles), np.sin(angles)
        eye = (
            self._x_m + SCANNER_M * math.cos(self._heading_rad),
            self._y_m + SCANNER_M * math.sin(self._heading_rad),
        )
        least, most = self.scan_range_m
        seen = _to_edges(self.layout, eye, way)
        for thing in self.layout.obstacles:
            if thing.standing:
                seen = np.minimum(seen, _to_thing(thing, eye, way))
        seen[seen < least] = most  # too near to be seen
        noise = NOISE_M * self._random.standard_normal(RAYS)
        self._scan = np.clip(seen + noise, least, most).astype(np.float32)


def fake_court(deaths: Collection[int] = ()) -> tuple[FakeBurger, FakeScene]:
    """Return a robot and its scene; see `FakeBurger` for `deaths`."""
    robot = FakeBurger(deaths)
    return robot, FakeScene(robot, COURT)


def _to_edges(layout: Layout, eye: Point, way: tuple[_Rays, _Rays]) -> _Rays:
    """Return meters along each ray to the walls at the edges of the floor."""
    nearest = np.full(RAYS, math.inf)
    for axis in (0, 1):
        slope = _sloping(way[axis])
        edge = np.where(slope > 0.0, layout.high[axis], layout.low[axis])
        nearest = np.minimum(nearest, (edge - eye[axis]) / slope)
    return nearest


def _to_thing(thing: Obstacle, eye: Point, way: tuple[_Rays, _Rays]) -> _Rays:
    """Return meters along each ray to a circle or a rectangle; infinite beside it."""
    c, s = math.cos(thing.heading_rad), math.sin(thing.heading_rad)
    dx, dy = eye[0] - thing.x_m, eye[1] - thing.y_m
    x, y = dx * c + dy * s, dy * c - dx * s
    ux, uy = way[0] * c + way[1] * s, way[1] * c - way[0] * s
    if thing.radius_m:
        along = -(x * ux + y * uy)
        inside = thing.radius_m**2 - (x * uy - y * ux) ** 2
        near = along - np.sqrt(np.maximum(inside, 0.0))
        return np.where((inside > 0.0) & (near > 0.0), near, math.inf)
    enter, leave = np.full(RAYS, -math.inf), np.full(RAYS, math.inf)
    for place, slope, half in ((x, _sloping(ux), thing.half_m[0]), (y, _sloping(uy), thing.half_m[1])):
        one, other = (-half - place) / slope, (half - place) / slope
        enter, leave = np.maximum(enter, np.minimum(one, other)), np.minimum(leave, np.maximum(one, other))
    return np.where((enter < leave) & (enter > 0.0), enter, math.inf)


def _sloping(slope: _Rays) -> _Rays:
    """Return slopes by which can be divided."""
    return np.copysign(np.maximum(np.abs(slope), _LEAST_SLOPE), slope)
