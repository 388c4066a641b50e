"""The clock of a mock robot, and the thread that advances the robot with this clock.

Robot time is real time times the speed. The robot never runs ahead of the clock. After a short delay of this
process, the robot catches up. After a longer delay, the clock itself loses time: otherwise, the dead man's
switch would stop the robot whenever the machine is busy for a moment.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from typing import Final

from palaestra_sim.mock_robot.robot import MockRobot

log = logging.getLogger(__name__)

MOST_BEHIND_S: Final = 0.1  # in robot time; half of the timeout of the dead man's switch
_REPORT_S: Final = 10.0  # in real time, between two reports
# If the clock loses a larger share of the time, an overload is logged. Every machine loses a smaller share.
_OVERLOAD: Final = 0.05


class Clock:
    """The robot's clock; safe to use from several threads.

    Args:
        speed: seconds of robot time for each second of real time.
        start_s: the robot time now.
        most_behind_s: the largest delay of the robot, in robot time; the clock loses any longer delay.
        monotonic: returns real time in seconds.

    Attributes:
        speed: the argument `speed`.
        lost_s: the robot time that the clock has lost.
    """

    def __init__(
        self,
        speed: float,
        start_s: float = 0.0,
        most_behind_s: float = MOST_BEHIND_S,
        monotonic: Callable[[], float] = time.monotonic,
    ) -> None:
        self.speed = speed
        self.lost_s = 0.0
        self._reached_s = start_s
        self._most_s = most_behind_s
        self._monotonic = monotonic
        self._origin_s = monotonic() - start_s / speed

    def now_s(self) -> float:
        """Return the robot time."""
        return min(self._unbounded_s(), self._reached_s + self._most_s)

    def real_s(self, robot_s: float) -> float:
        """Return the duration in real time of a duration in robot time."""
        return robot_s / self.speed

    def behind_s(self, reached_s: float) -> float:
        """Return the time by which a robot at `reached_s` is behind; this may make the clock lose time."""
        self._reached_s = reached_s
        self.lost_s += max(0.0, self._unbounded_s() - reached_s - self._most_s)
        return self.now_s() - reached_s

    def _unbounded_s(self) -> float:
        return (self._monotonic() - self._origin_s) * self.speed - self.lost_s


class PaceThread:
    """Advances a robot with its clock, in a thread, between `start` and `stop`."""

    def __init__(self, robot: MockRobot, clock: Clock) -> None:
        self._robot = robot
        self._clock = clock
        self._step_s = robot.step_ms / 1000.0
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="pace", daemon=True)

    def start(self) -> None:
        """Start to advance the robot."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the robot's time."""
        self._stopping.set()
        self._thread.join()

    def _run(self) -> None:
        overload = _Overload(self._clock)
        while not self._stopping.wait(self._clock.real_s(self._until_next_s())):
            steps = int(self._clock.behind_s(self._robot.time_s) / self._step_s)
            if steps:
                self._robot.advance(steps * self._robot.step_ms)
            overload.report()

    def _until_next_s(self) -> float:
        return max(0.0, self._robot.time_s + self._step_s - self._clock.now_s())


class _Overload:
    """Reports to the log if the clock loses much time."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._begin()

    def _begin(self) -> None:
        self._lost_s = self._clock.lost_s
        self._began = time.monotonic()

    def report(self) -> None:
        real_s = time.monotonic() - self._began
        if real_s < _REPORT_S:
            return
        share = (self._clock.lost_s - self._lost_s) / (real_s * self._clock.speed)
        if share > _OVERLOAD:
            log.warning(
                "overload: the robot's clock has lost %.0f %% of the last %.0f s; use less than --speed %g",
                100.0 * share,
                real_s,
                self._clock.speed,
            )
        self._begin()
