"""Decide when a healthy simulator is restarted between two episodes."""

from __future__ import annotations

import time
from collections.abc import Callable

from palaestra_trainer.job.simulator_configuration import Recycle

# Seconds between two requests for the memory: for each request, the sidecar sums the memory of all processes
# of the simulator.
ASK_MEMORY_EVERY_S = 1.0

_MINUTE_S = 60.0
_MIB = 2**20


class RecyclePolicy:
    """Compares the resets, the minutes and the memory of one simulator with its limits.

    Args:
        limits: the limits of the simulator; None: no limits.
        memory: a function that returns the memory of the simulator's processes in bytes; None: unknown.
        clock: a function that returns seconds from any starting point.
    """

    def __init__(
        self,
        limits: Recycle | None,
        memory: Callable[[], int | None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._limits = limits or Recycle()
        self._memory = memory
        self._clock = clock
        self._since = self._asked = clock()

    def begin(self) -> None:
        """Count resets and minutes from now on; call this method after a start or a takeover."""
        self._since = self._clock()

    def due(self, resets: int, episodes: int = 1) -> str | None:
        """Return the reason to restart the simulator before the next `episodes`; None without a reason.

        Before several episodes, the limit of resets is a reason only if a restart now avoids a restart
        between these episodes.
        """
        checks = (self._by_resets(resets, episodes), self._by_age(), self._by_memory())
        return next((reason for reason in checks if reason is not None), None)

    def _by_resets(self, resets: int, episodes: int) -> str | None:
        limit, last = self._limits.after_resets, episodes - 1
        return f"{resets} resets" if limit and (resets + last) // limit > last // limit else None

    def _by_age(self) -> str | None:
        limit, minutes = self._limits.after_minutes, (self._clock() - self._since) / _MINUTE_S
        return f"{minutes:.1f} minutes in use" if limit is not None and minutes >= limit else None

    def _by_memory(self) -> str | None:
        limit, now = self._limits.above_memory_bytes, self._clock()
        if limit is None or now - self._asked < ASK_MEMORY_EVERY_S:
            return None
        self._asked = now
        used = self._memory()
        return f"{used / _MIB:.0f} MiB of memory" if used is not None and used > limit else None
