"""The firmware of a Robotino's base: it decides the velocity of the robot from the commands that arrive.

A dead man's switch stops the robot: without a command for more than 200 ms, the target velocity is 0. Source:
wiki.openrobotino.org, Rest_api, /data/omnidrive. The limits of `mobile_base` apply to every acceleration,
also to a stop. The firmware obeys the newest command, from any connection.
"""

from __future__ import annotations

import math
from typing import Final

from palaestra_sim.scene.mobile_base import ACCELERATIONS
from palaestra_sim.scene.wheel_kinematics import Twist

DEAD_MAN_S: Final = 0.2
STOP: Final[Twist] = (0.0, 0.0, 0.0)


class BaseFirmware:
    """The commands to the base; all times are robot time in seconds.

    Attributes:
        commands: the number of commands that have arrived.
        last_command_s: the time of the last command; None before the first command.
    """

    def __init__(self) -> None:
        self.commands = 0
        self.last_command_s: float | None = None
        self._commanded = STOP

    def command(self, velocity: Twist, now_s: float) -> None:
        """Set the target velocity: vx, vy in m/s and omega in rad/s, in the robot's axes."""
        self._commanded = velocity
        self.last_command_s = now_s
        self.commands += 1

    def target(self, now_s: float) -> Twist:
        """Return the commanded velocity, or zeros if the dead man's switch stops the robot."""
        if self.last_command_s is None or now_s - self.last_command_s > DEAD_MAN_S:
            return STOP
        return self._commanded


def approach(current: Twist, target: Twist, step_s: float) -> Twist:
    """Return the velocity after `step_s` seconds of acceleration from `current` toward `target`.

    The axis that needs the longest time sets the duration. The other two axes accelerate in proportion, as in
    `base_accelerate` of Webots' controller robotino3.
    """
    needed = max(
        abs(goal - now) / (limit * step_s)
        for now, goal, limit in zip(current, target, ACCELERATIONS, strict=True)
    )
    if needed <= 1.0:
        return target
    vx, vy, omega = (
        now + (goal - now) / needed if math.isfinite(needed) else now
        for now, goal in zip(current, target, strict=True)
    )
    return vx, vy, omega
