"""Limits for faults: restarts of a simulator in a time window, and the smallest size of a group."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from palaestra_trainer.errors import FaultBudgetSpent, FaultKind, SimulatorFault

# This number of restarts within the window suggests a permanent fault.
FLAPPING = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class RestartLimit:
    """The limit for restarts of a member.

    Attributes:
        restarts: the largest number of restarts after faults within any `within_s` seconds.
    """

    restarts: int = 10
    within_s: float = 600.0


@dataclass(slots=True)
class RestartBudget:
    """The restart budget of one simulator, in a sliding window of time."""

    simulator: str
    limit: RestartLimit
    clock: Callable[[], float] = time.monotonic
    _spent: deque[tuple[float, FaultKind]] = field(default_factory=deque)

    @property
    def flapping(self) -> bool:
        """Whether the simulator was restarted at least `FLAPPING` times within `within_s`."""
        return len(self._spent) >= FLAPPING

    @property
    def spent_share(self) -> float:
        """The share of `limit.restarts` spent within `within_s`, 0 to 1; any thread may read it.

        For a limit of 0 the share is always 0, because the first fault is final.
        """
        now, limit = self.clock(), self.limit.restarts
        recent = sum(now - at < self.limit.within_s for at, _ in tuple(self._spent))
        return recent / limit if limit else 0.0

    def spend(self, fault: SimulatorFault) -> None:
        """Take one restart from the budget, to repair `fault`.

        Raises:
            FaultBudgetSpent: `limit.restarts` restarts were already spent within `within_s`.
        """
        now = self.clock()
        while self._spent and now - self._spent[0][0] >= self.limit.within_s:
            self._spent.popleft()
        if len(self._spent) >= self.limit.restarts:
            raise FaultBudgetSpent(self._message(fault)) from fault
        self._spent.append((now, fault.kind))

    def _message(self, fault: SimulatorFault) -> str:
        kinds = Counter(kind for _, kind in self._spent).most_common()
        faults = ", ".join(f"{kind} {count}" for kind, count in kinds)
        return (
            f"{self.simulator}: {'flapping: ' if self.flapping else ''}"
            f"{self.limit.restarts} restarts within {self.limit.within_s:g} s did not repair the simulator "
            f"({f'{faults}; ' if faults else ''}last: {fault}); "
            "read the simulator's log, or raise restart.limit"
        )


class Group:
    """The number of simulators left in a group, and the number that the run needs.

    Args:
        left: number of simulators in the group.
        least: the smallest number of simulators that the run needs, at least 1; None: all of them.
    """

    def __init__(self, left: int = 1, least: int | None = None) -> None:
        self.least = left if least is None else min(least, left)
        self._left = left
        self._lock = threading.Lock()

    def lose_one(self) -> bool:
        """Count one more simulator as lost and return True; return False if the run needs all of them."""
        with self._lock:
            if self._left <= self.least:
                return False
            self._left -= 1
            return True
