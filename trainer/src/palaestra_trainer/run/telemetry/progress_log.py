"""Log the progress of a run every few seconds."""

from __future__ import annotations

import time

import structlog

from palaestra_protocol.pod.status import TrainerStatus

log = structlog.get_logger(__name__)


class ProgressLog:
    """Logs the progress, at most once every `every_s` seconds."""

    def __init__(self, every_s: float = 10.0) -> None:
        self._every_s = every_s
        self._next = 0.0

    @property
    def due(self) -> bool:
        """Whether the progress should be logged now; this check is fast, because every step makes it."""
        return time.monotonic() >= self._next

    def write(self, status: TrainerStatus) -> None:
        """Log one line."""
        log.info(
            "progress",
            step=status.step,
            target=status.target,
            success_rate=status.success_rate,
            mean_return=_rounded(status.mean_return),
            steps_per_second=_rounded(status.steps_per_second),
            faults=sum(simulator.restarts for simulator in status.simulators),
        )
        self._next = time.monotonic() + self._every_s


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
