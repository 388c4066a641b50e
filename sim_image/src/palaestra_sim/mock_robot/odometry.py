"""The odometry of a Robotino: the pose that the robot computes from the motion of its wheels.

The odometry has its own frame: it starts at a pose that has no relation to the room, and a person who carries
the robot does not change it. It integrates the motion of the wheels, also while the wheels slip at an
obstacle. Three errors grow with the motion, in proportion to `drift`. With a drift of 0.02, the size of each
error is:

- distance: 2 % of the way
- heading: 2 % of the turned angle
- heading: 0.01 rad for each meter of the way, even if the robot drives straight ahead

So after a straight way of 2 m, the odometry is off by 2.2 % of the way. The signs of the three errors are
drawn from the seed, so two runs with the same seed and motion are equal.
"""

from __future__ import annotations

import math
from random import Random
from typing import Final

from palaestra_sim.scene.wheel_kinematics import Twist

_FARTHEST_M: Final = 5.0  # largest absolute x and y of the start position

Reading = tuple[float, float, float, float, float, float, int]
"""x and y in m; rot in rad, in (-pi, pi]; vx, vy in m/s and omega in rad/s, in the robot's axes; seq."""


class DriftingOdometry:
    """The odometry of one robot.

    Args:
        drift: the size of the errors, as a share; 0 for a perfect odometry.
        random: draws the start and the signs of the errors.
    """

    def __init__(self, drift: float, random: Random) -> None:
        self._x = random.uniform(-_FARTHEST_M, _FARTHEST_M)
        self._y = random.uniform(-_FARTHEST_M, _FARTHEST_M)
        self._heading = random.uniform(-math.pi, math.pi)
        self._distance_scale = 1.0 + drift * random.choice((-1.0, 1.0))
        self._turn_scale = 1.0 + drift * random.choice((-1.0, 1.0))
        self._turn_per_meter = 0.5 * drift * random.choice((-1.0, 1.0))
        self._velocity: Twist = (0.0, 0.0, 0.0)
        self._seq = 0

    def advance(self, velocity: Twist, step_s: float) -> None:
        """Add the motion of one step: vx, vy in m/s and omega in rad/s, in the robot's axes."""
        vx, vy, omega = velocity
        way_m = math.hypot(vx, vy) * step_s
        turned = omega * step_s * self._turn_scale + way_m * self._turn_per_meter
        middle = self._heading + 0.5 * turned  # the stub drives the same arc
        c, s = math.cos(middle), math.sin(middle)
        scale = step_s * self._distance_scale
        self._x += (vx * c - vy * s) * scale
        self._y += (vx * s + vy * c) * scale
        self._heading = math.remainder(self._heading + turned, 2.0 * math.pi)
        self._velocity = velocity
        self._seq += 1

    @property
    def reading(self) -> Reading:
        """The values of /data/odometry."""
        return (self._x, self._y, self._heading, *self._velocity, self._seq)
