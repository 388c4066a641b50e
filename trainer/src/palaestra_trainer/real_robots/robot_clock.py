"""The time of a robot, in seconds.

A real robot has real time. The time of a mock robot with `--speed N` runs N times as fast, so a program that
drives this robot multiplies all its times by the same factor.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

_CLOCK = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)  # only Linux has the former


@dataclass(frozen=True, slots=True)
class RobotClock:
    """A monotonic clock, which also counts the time in which this computer is suspended.

    Attributes:
        speed: robot seconds in a second; 1 for a real robot.
    """

    speed: float = 1.0

    def now_s(self) -> float:
        """Return the robot's time in seconds, from an arbitrary start."""
        return time.clock_gettime(_CLOCK) * self.speed

    def real_s(self, robot_s: float) -> float:
        """Return the seconds of real time in which `robot_s` seconds of the robot's time pass."""
        return robot_s / self.speed

    def wait(self, event: threading.Event, until_s: float) -> bool:
        """Wait for an event until a time of this clock; return whether the event is set."""
        return event.wait(max(self.real_s(until_s - self.now_s()), 0.0))
