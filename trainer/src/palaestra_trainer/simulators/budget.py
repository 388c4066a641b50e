"""How many faults are borne: of one simulator in a time, and of a group before too few are left."""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from palaestra_trainer.errors import FaultBudgetSpent, FaultKind, SimulatorFault

# So many restarts in a short time are no accident: whatever comes up breaks again.
FLAPPING = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Care:
    """How a member is looked after.

    Attributes:
        restart_limit: restarts after faults within any `restart_within_s` seconds.
    """

    restart_limit: int = 10
    restart_within_s: float = 600.0


@dataclass(slots=True)
class RestartBudget:
    """How many restarts one simulator has left, by a sliding window of time."""

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
        """Share of `restart_limit` that was spent within `restart_within_s`, 0 to 1; from any thread.

        Of none, none is spent: nothing could be warned of.
        """
        now, limit = self.clock(), self.care.restart_limit
        recent = sum(now - at < self.care.restart_within_s for at, _ in tuple(self._spent))
        return recent / limit if limit else 0.0

    def spend(self, fault: SimulatorFault) -> None:
        """Take one restart, to mend `fault`.

        Raises:
            FaultBudgetSpent: `restart_limit` restarts lie within `restart_within_s` already.
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
    """The simulators of one kind, and how many of them must be left.

    Args:
        left: how many there are.
        least: how many there must be, at least one; None: all of them.
    """

    def __init__(self, left: int = 1, least: int | None = None) -> None:
        self.least = left if least is None else min(least, left)
        self._left = left
        self._lock = threading.Lock()

    def lose_one(self) -> bool:
        """Return whether the others are enough to go on; if so, there is one less."""
        with self._lock:
            if self._left <= self.least:
                return False
            self._left -= 1
            return True
