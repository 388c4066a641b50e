"""The time of the topic /clock, for a policy that drives a robot of a simulation."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from palaestra_trainer.errors import RobotUnfit
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.waiting.check import Check

_SLICE_S: Final = 0.002  # a simulation may be much faster than real time
_FIRST_S: Final = 5.0


class SimulationTime:
    """Time that never decreases, from a node's clock with `use_sim_time`.

    After a simulation has begun again at time 0, this time continues. Otherwise all readings of the new
    simulation would be older than those of the last one.

    Args:
        ros_now_s: returns the time of the node's clock in seconds; 0 before the first message.
    """

    def __init__(self, ros_now_s: Callable[[], float]) -> None:
        self._ros_now_s = ros_now_s
        self._lock = threading.Lock()
        self._last_s = 0.0  # the newest time of the node's clock
        self._added_s = 0.0
        self._left: tuple[float, float] | None = None

    def now_s(self) -> float:
        """Return the time of the simulation in seconds, from an arbitrary start."""
        with self._lock:
            if self._left is not None:
                at_s, real_s = self._left
                return at_s + time.monotonic() - real_s
            ros_s = self._ros_now_s()
            self._added_s += max(self._last_s - ros_s, 0.0)
            self._last_s = ros_s
            return ros_s + self._added_s

    def leave(self) -> None:
        """Count real time from now on, so that a paused simulation does not hold up the program's end."""
        now_s = self.now_s()
        with self._lock:
            self._left = (now_s, time.monotonic())

    def refuse_unset(self, check: Check) -> None:
        """Wait for the first message of /clock; `check` is called often, and may raise.

        Raises:
            RobotUnfit: no message arrives within 5 s of real time.
        """
        end_s = time.monotonic() + _FIRST_S
        while self._ros_now_s() == 0.0:
            if time.monotonic() > end_s:
                raise RobotUnfit("/clock: use_sim_time is true, but no time arrives; start the simulation")
            check()
            time.sleep(_SLICE_S)


@dataclass(frozen=True, slots=True)
class SimulationClock(RobotClock):
    """A clock of a robot in a simulation, which may pause, or change its speed.

    Attributes:
        time: the time of the simulation.
    """

    time: SimulationTime = field(kw_only=True)

    def now_s(self) -> float:
        """Return the time of the simulation in seconds, from an arbitrary start."""
        return self.time.now_s()

    def real_s(self, robot_s: float) -> float:
        """Return a short real time, after which the caller looks at the clock again.

        The real time in which the simulation advances by `robot_s` seconds is not known in advance.
        """
        return min(robot_s, _SLICE_S)

    def wait(self, event: threading.Event, until_s: float) -> bool:
        """Wait for an event until a time of this clock; return whether the event is set."""
        while (left_s := until_s - self.now_s()) > 0.0:
            if event.wait(self.real_s(left_s)):
                return True
        return event.is_set()
