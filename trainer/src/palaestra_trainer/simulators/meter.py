"""The counts of one simulator: steps, resets, simulated time and spent restarts."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from palaestra_sim.protocol.metrics import Tally
from palaestra_trainer import families
from palaestra_trainer.simulators.budget import RestartBudget
from palaestra_trainer.simulators.member import Member


@runtime_checkable
class Timed(Protocol):
    """A member that counts its simulated time."""

    @property
    def simulated_s(self) -> float:
        """Seconds of simulated time in this attempt, over all restarts."""
        ...


class Meter:
    """Counts for one member; written by the thread that steps it, read by any thread.

    Attributes:
        steps: seconds that each environment step took.
        resets: episodes begun.

    Args:
        member: the member that is played in.
        budget: its restart budget.
    """

    def __init__(self, member: Member, budget: RestartBudget) -> None:
        self.steps: Tally = families.STEP_DURATION.tally()
        self.resets = 0
        self._member = member
        self._budget = budget

    @property
    def simulated_s(self) -> float | None:
        """Simulated seconds; None: the member does not count them."""
        return self._member.simulated_s if isinstance(self._member, Timed) else None

    @property
    def budget_spent(self) -> float:
        """Share of its restart budget that is spent now, 0 to 1."""
        return self._budget.spent_share
