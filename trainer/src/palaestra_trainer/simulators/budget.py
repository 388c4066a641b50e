"""Limits on faults: restarts of one simulator within a time, and the least size of a group."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from palaestra_trainer.errors import FaultBudgetSpent, FaultKind, SimulatorFault

# So many restarts within a short time show a permanent fault.
FLAPPING = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Care:
    """The restart limit of a member.

    Attributes:
        restart_limit: restarts after faults within any `restart_within_s` seconds.
    """

    restart_limit: int = 10
    restart_within_s: float = 600.0


@dataclass(slots=True)
class RestartBudget:
    """The restarts that one simulator has left, counted in a sliding window of time."""

    simulator: str
    care: Care
    clock: Callable[[], float] = time.monotonic
    _spent: deque[tuple[float, FaultKind]] = field(default_factory=deque)

    @property
    def flapping(self) -> bool:
        """Whether it was restarted `FLAPPING` times or more within `restart_within_s`."""
        return len(self._spent) >= FLAPPING

    @property
    def spent_share(self) -> float:
        """Share of `restart_limit` spent within `restart_within_s`, 0 to 1; callable from any thread.

        It is 0 for a limit of 0: no warning would be possible.
        """
        now, limit = self.clock(), self.care.restart_limit
        recent = sum(now - at < self.care.restart_within_s for at, _ in tuple(self._spent))
        return recent / limit if limit else 0.0

    def spend(self, fault: SimulatorFault) -> None:
        """Take one restart from the budget, to repair `fault`.

        Raises:
            FaultBudgetSpent: `restart_limit` restarts were already spent within `restart_within_s`.
        """
        now = self.clock()
        while self._spent and now - self._spent[0][0] >= self.care.restart_within_s:
            self._spent.popleft()
        if len(self._spent) >= self.care.restart_limit:
            raise FaultBudgetSpent(self._message(fault)) from fault
        self._spent.append((now, fault.kind))

    def _message(self, fault: SimulatorFault) -> str:
        kinds = Counter(kind for _, kind in self._spent).most_common()
        faults = ", ".join(f"{kind} {count}" for kind, count in kinds)
        return (
            f"{self.simulator}: {'flapping: ' if self.flapping else ''}"
            f"{self.care.restart_limit} restarts within {self.care.restart_within_s:g} s did not mend it "
            f"({f'{faults}; ' if faults else ''}last: {fault}); "
            "read the simulator's log, or raise restart.limit"
        )


class Group:
    """The simulators of one group, and how many of them the run needs.

    Args:
        left: number of simulators in the group.
        least: the least number, at least one; None: all of them.
    """

    def __init__(self, left: int = 1, least: int | None = None) -> None:
        self.least = left if least is None else min(least, left)
        self._left = left
        self._lock = threading.Lock()

    def lose_one(self) -> bool:
        """Return whether the run can continue without one more simulator; if so, count it as lost."""
        with self._lock:
            if self._left <= self.least:
                return False
            self._left -= 1
            return True
