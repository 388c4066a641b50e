"""Decide which faults occur at the k-th event of a life; a life is one run of the simulator's process.

Pure: the random number for an event is a hash of the seed, the simulator, its life, the fault and the number
of the event. So the number does not depend on earlier events, and an additional fault does not change the
events at which other faults occur. Two lives of a simulator, or two simulators of a group, get different
random numbers.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass

from palaestra_sim.faults.kinds import Delayed, FaultEvent, InjectedFault

_DRAW_BYTES = 7  # 56 bits: more than the 53 bits of a float's mantissa
_DRAWS = float(256**_DRAW_BYTES)


@dataclass(frozen=True, slots=True, kw_only=True)
class Life:
    """The inputs of the random numbers; they are constant in one life.

    Attributes:
        seed: the seed that a user chose.
        simulator: the name of the simulator, so that simulators with the same seed get different numbers.
        number: the number of the life; the program that starts the simulator counts lives from 1.
    """

    seed: int = 0
    simulator: str = ""
    number: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultSchedule:
    """The faults of one life."""

    faults: Sequence[InjectedFault]
    life: Life

    def happens(self, fault: InjectedFault, number: int) -> bool:
        """Return whether `fault` occurs at event `number`, counted from 1."""
        return fault.trigger.fires(number, self._draw(fault, number, "happens"))

    def at(self, event: FaultEvent, number: int) -> tuple[InjectedFault, ...]:
        """Return the faults that occur at event `number`, in the order in which the user wrote them."""
        return tuple(
            fault for fault in self.faults if fault.trigger.event is event and self.happens(fault, number)
        )

    def delay_s(self, fault: Delayed, number: int) -> float:
        """Return the delay in seconds at event `number`: the latency, plus a random share of the jitter."""
        return fault.latency_s + fault.jitter_s * self._draw(fault, number, "jitter")

    def _draw(self, fault: InjectedFault, number: int, purpose: str) -> float:
        """Return a random number in [0, 1), uniformly distributed."""
        life = self.life
        words = (life.seed, life.simulator, life.number, fault.text, number, purpose)
        digest = hashlib.blake2b(repr(words).encode(), digest_size=_DRAW_BYTES).digest()
        return int.from_bytes(digest) / _DRAWS
