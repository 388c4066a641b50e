"""Count steps, slow steps, resets, simulated time and spent restarts of one simulator."""

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
    """The usual duration of one simulator's steps, which is the median of the last hundred steps."""

    def __init__(self) -> None:
        self._recent: deque[float] = deque(maxlen=_REMEMBERED)

    def slow(self, seconds: float) -> bool:
        """Return whether a step that took `seconds` was slow, and record its duration.

        A step is slow if it takes more than 10 times the median and more than 50 ms. The first ten steps
        never count as slow.
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
    """The statistics of one member, which its thread writes and any thread may read.

    Attributes:
        steps: histogram of the seconds that environment steps took.
        resets: number of episodes begun.
        stepped: whether an environment step was taken.

    Args:
        member: the member whose steps are counted.
        budget: restart budget of the member.
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
        """Seconds of simulated time; None if the member does not count it."""
        return self._member.simulated_s if isinstance(self._member, Timed) else None

    @property
    def budget_spent(self) -> float:
        """The share of the member's restart budget that is spent now, 0 to 1."""
        return self._budget.spent_share
