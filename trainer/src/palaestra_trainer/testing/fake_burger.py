"""A fake TurtleBot3 Burger on the floor of the world `court`, computed in this process.

`fake_court()` returns a robot and a scene for `NavigateEnv`, with some thousand steps per second. The robot
drives as `FakeWheels` does. Its scanner has the rays, the range and the noise of the scanner in Webots. The
robot can crash at given steps, as simulators may do.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor
from palaestra_trainer.robots.capabilities import Scanner
from palaestra_trainer.robots.layout import FloorLayout, Obstacle
from palaestra_trainer.testing.fake_scene import FakeScene
from palaestra_trainer.testing.fake_wheels import FakeWheels
from palaestra_trainer.testing.rays import nearest

RAYS = 360
SCANNER_M = -0.03  # position of the scanner, relative to the robot's center and along its heading
NOISE_M = 0.015  # standard deviation: 0.0043 of the greatest distance. Source: RobotisLds01 of Webots
ROWS = (np.arange(RAYS) + 0.5) * (2.0 * math.pi / RAYS) - math.pi
TOP_M = 0.3

COURT = FloorLayout(
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


class FakeBurger(FakeWheels, Scanner):
    """A fake TurtleBot3 Burger; the arguments are those of `FakeWheels`."""

    floor = COURT
    axle_m = 0.16
    radius_m = 0.111
    speed_m_s = 0.22  # the rim speed of the fastest wheel
    turn_rad_s = 2.0 * speed_m_s / axle_m
    scan_view_rad = 2.0 * math.pi
    scan_range_m = (0.12, 3.5)
    _scans = False

    def use_scanner(self) -> None:
        """Make the scanner measure from now on."""
        self._scans = True

    def scan(self) -> NDArray[np.float32]:
        """Return a new array of distances in meters, shape (360,), counter-clockwise from behind."""
        self._live()
        if not self._scans:
            raise NoSuchSensor(f"{self._name}: its scanner is not in use; call use_scanner(), then advance()")
        return self._scan.copy()

    def _look(self) -> None:
        origin = (
            self._x_m + SCANNER_M * math.cos(self._heading_rad),
            self._y_m + SCANNER_M * math.sin(self._heading_rad),
        )
        least, most = self.scan_range_m
        seen = nearest(self.layout, origin, self._heading_rad + ROWS)
        seen[seen < least] = most  # the scanner does not detect an object that is too near
        noise = NOISE_M * self._random.standard_normal(RAYS)
        self._scan = np.clip(seen + noise, least, most).astype(np.float32)


def fake_court(deaths: Collection[int] = ()) -> tuple[FakeBurger, FakeScene]:
    """Return a robot and its scene; see `FakeWheels` for `deaths`."""
    robot = FakeBurger(deaths)
    return robot, FakeScene(robot, COURT)
