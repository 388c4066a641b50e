"""A fake robot on two wheels, computed in this process.

The robot drives without slip, and follows commands without delay. Walls and obstacles stop the robot and let
it slide. A subclass adds sensors.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection
from typing import ClassVar

import numpy as np

from palaestra_trainer.robots.base import RobotAbc
from palaestra_trainer.robots.capabilities import Localization, Steering
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout
from palaestra_trainer.testing.crashing import Crashing
from palaestra_trainer.testing.fake_robotino import wrapped

PERIOD_S = 0.192


class FakeWheels(Crashing, RobotAbc, Steering, Localization):
    """A fake robot on two wheels; a subclass sets `floor`, sizes and speeds, and implements `_look`.

    Args:
        deaths: numbers of the `advance` calls at which the robot crashes, counted from 1; a restart does not
            reset the count. After a crash, every call raises `SimulatorDead` until `restart`.
        name: name of the robot in faults.

    Attributes:
        floor: the initial layout.
        axle_m: distance between the wheels.
        layout: the floor and the obstacles on it.
        target: x, y in meters of the mark.
    """

    floor: ClassVar[FloorLayout]
    axle_m: ClassVar[float]

    def __init__(self, deaths: Collection[int] = (), name: str = "fake") -> None:
        super().__init__(deaths, name)
        self.layout = self.floor
        self.target: Point = (0.0, 0.0)
        self._heading_rad = 0.0
        self.place(Pose(0.0, 0.0, 0.0), seed=0)

    @property
    def period_s(self) -> float:
        """The duration of six basic steps of 32 ms."""
        return PERIOD_S

    def steer(self, forward: float, turn: float) -> None:
        """Set the wanted velocity; if a wheel cannot turn that fast, drive the same curve slower."""
        self._live()
        rim = abs(forward) + 0.5 * abs(turn) * self.axle_m
        slower = min(1.0, self.speed_m_s / max(rim, self.speed_m_s))
        self._wanted = slower * forward, slower * turn

    def pose(self) -> Pose:
        """Return the pose after the last step."""
        self._live()
        return Pose(self._x_m, self._y_m, self._heading_rad)

    def advance(self) -> int:
        """Simulate one control period; return 0, because the fake never needs extra periods."""
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
        """Put the robot at `pose`, at rest, and update all readings; `seed` decides the noise."""
        self._live()
        self._x_m, self._y_m, self._heading_rad = pose.x_m, pose.y_m, pose.heading_rad
        self._wanted = (0.0, 0.0)
        self._random = np.random.default_rng(seed)
        self._look()

    @abstractmethod
    def _look(self) -> None:
        """Update the readings of the sensors from the current pose."""

    def _slide(self) -> None:
        """Move the robot out of walls and obstacles that it hit."""
        (low_x, low_y), (high_x, high_y) = self.layout.low, self.layout.high
        for thing in self.layout.obstacles:
            inside = self.radius_m - thing.gap(self._x_m, self._y_m)
            if thing.standing and inside > 0.0:
                away = thing.away(self._x_m, self._y_m)
                self._x_m += inside * away[0]
                self._y_m += inside * away[1]
        self._x_m = min(max(self._x_m, low_x + self.radius_m), high_x - self.radius_m)
        self._y_m = min(max(self._y_m, low_y + self.radius_m), high_y - self.radius_m)
