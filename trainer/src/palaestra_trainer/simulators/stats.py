"""The counts of one simulator: steps, slow steps, resets, simulated time and spent restarts."""

from __future__ import annotations

from collections import deque
from typing import Protocol, runtime_checkable

from palaestra_protocol.metrics import Tally
from palaestra_trainer.simulators.budget import RestartBudget
from palaestra_trainer.simulators.interface import Member

# Bounds of the buckets in which Prometheus counts the durations of steps.
STEP_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
SLOW_TIMES = 10
SLOW_S = 0.05
_REMEMBERED = 100
_FEWEST = 10


class Pace:
    """The usual duration of one simulator's steps: the median of the last hundred."""

    def __init__(self) -> None:
        self._recent: deque[float] = deque(maxlen=_REMEMBERED)

    def slow(self, seconds: float) -> bool:
        """Return whether a step that took `seconds` was slow, and remember its duration.

        A step is slow if it takes more than 10 times the median and more than 50 ms. None of the first ten
        steps is slow.
        """
        slow = seconds > SLOW_S and len(self._recent) >= _FEWEST and seconds > SLOW_TIMES * self._median()
        self._recent.append(seconds)
        return slow

    def _median(self) -> float:
        return sorted(self._recent)[len(self._recent) // 2]


@runtime_checkable
class Timed(Protocol):
    """A member that counts its simulated time."""

    @property
    def simulated_s(self) -> float:
        """Seconds of simulated time in this attempt, over all restarts of the simulator."""
        ...


class SimulatorStats:
    """Counts for one member; written by the thread that steps it, read by any thread.

    Attributes:
        steps: seconds that each environment step took.
        resets: episodes begun.
        stepped: whether an environment step was taken.

    Args:
        member: the member whose steps are counted.
        budget: its restart budget.
    """

    def __init__(self, member: Member, budget: RestartBudget) -> None:
        self.steps: Tally = Tally(STEP_S)
        self.resets, self.stepped = 0, False
        self._member = member
        self._budget = budget
        self._pace = Pace()

    def count_step(self, seconds: float) -> bool:
        """Count an environment step that took `seconds`; return whether it was slow."""
        self.stepped = True
        self.steps.observe(seconds)
        return self._pace.slow(seconds)

    @property
    def simulated_s(self) -> float | None:
        """Seconds of simulated time; None: the member does not count it."""
        return self._member.simulated_s if isinstance(self._member, Timed) else None

    @property
    def budget_spent(self) -> float:
        """Share of its restart budget that is spent now, 0 to 1."""
        return self._budget.spent_share
