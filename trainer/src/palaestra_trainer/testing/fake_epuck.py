"""A fake e-puck on the floor of the world `pen`, computed in this process.

`fake_pen()` returns a robot and a scene, with some ten thousand steps per second. The robot drives as
`FakeWheels` does. Its infrared sensors have the positions and the range of the sensors in Webots. The robot
can crash at given steps, as simulators may do.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.robots.capabilities import Distances
from palaestra_trainer.robots.layout import FloorLayout, Obstacle
from palaestra_trainer.testing.fake_scene import FakeScene
from palaestra_trainer.testing.fake_wheels import FakeWheels
from palaestra_trainer.testing.rays import nearest

# x and y of each sensor, counter-clockwise from the front left. Source: E-puck of Webots.
SENSORS_M = np.array(
    [
        (0.03, 0.01),
        (0.022, 0.025),
        (0.0, 0.031),
        (-0.03, 0.015),
        (-0.03, -0.015),
        (0.0, -0.031),
        (0.022, -0.025),
        (0.03, -0.01),
    ]
)
NOISE_M = 0.001  # standard deviation, averaged over the range. Source: E-puckDistanceSensor of Webots
TOP_M = 0.1

PEN = FloorLayout(
    low=(-0.6, -0.4),
    high=(0.6, 0.4),
    obstacles=tuple(
        Obstacle(name=f"CYLINDER_{number}", x_m=0.0, y_m=y_m, bottom_m=0.0, top_m=TOP_M, radius_m=0.06)
        for number, y_m in enumerate((0.25, -0.25))
    ),
)


class FakeEPuck(FakeWheels, Distances):
    """A fake e-puck; the arguments are those of `FakeWheels`."""

    floor = PEN
    axle_m = 0.052
    radius_m = 0.037
    speed_m_s = 0.125  # the rim speed of the fastest wheel
    turn_rad_s = 2.0 * speed_m_s / axle_m
    bearings_rad = tuple(
        math.radians(angle) for angle in (17.1, 45.8, 90.0, 151.2, 208.5, 270.0, 314.1, 342.8)
    )
    distance_range_m = (0.0, 0.07)

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacle, shape (8,), counter-clockwise from the front left."""
        self._live()
        return self._distances.copy()

    def _look(self) -> None:
        c, s = math.cos(self._heading_rad), math.sin(self._heading_rad)
        x, y = SENSORS_M.T
        eyes = self._x_m + x * c - y * s, self._y_m + x * s + y * c
        seen = nearest(self.layout, eyes, self._heading_rad + np.array(self.bearings_rad))
        noise = NOISE_M * self._random.standard_normal(len(seen))
        self._distances = np.clip(seen + noise, *self.distance_range_m).astype(np.float32)


def fake_pen(deaths: Collection[int] = ()) -> tuple[FakeEPuck, FakeScene]:
    """Return a robot and its scene; see `FakeWheels` for `deaths`."""
    robot = FakeEPuck(deaths)
    return robot, FakeScene(robot, PEN)
