"""Write the faults of a run to a file: a line per fault, and a line when the simulator is up again.

A line is written at once, so the file has a fault even if the run is killed before the simulator is up.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import structlog

from palaestra_protocol.pod.status import FaultRecord
from palaestra_trainer.job.run_directory import append_line

log = structlog.get_logger(__name__)

MOST_BYTES = 2**20  # size limit of the file; the counters of the run still count every fault


class FaultLog:
    """Writes the faults of one attempt; any thread may call its methods.

    A full disk is logged once. This class does not end the run, because the next checkpoint reports the full
    disk.

    Args:
        path: the file; it may be missing.
        attempt: number of the attempt.
        clock: a function that returns seconds from any starting point.
    """

    def __init__(self, path: Path, attempt: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._path = path
        self._attempt = attempt
        self._clock = clock
        self._lock = threading.Lock()
        self._down: dict[str, list[float]] = {}  # for each simulator that is down, the times of its faults
        self._full = False

    def broke(self, fault: FaultRecord, steps_lost: int) -> None:
        """Record a fault and the steps of the episode that it truncated."""
        with self._lock:
            self._down.setdefault(fault.simulator, []).append(self._clock())
            self._write(fault.to_json() | {"attempt": self._attempt, "steps_lost": steps_lost})

    def is_up(self, simulator: str) -> None:
        """Record that a simulator is up again; do nothing if it was not down."""
        with self._lock:
            if times := self._down.pop(simulator, None):
                seconds = [round(self._clock() - began, 3) for began in times]
                self._write({"simulator": simulator, "attempt": self._attempt, "up_after_s": seconds})

    def _write(self, content: dict[str, Any]) -> None:
        if self._full:
            return
        try:
            if self._path.exists() and self._path.stat().st_size > MOST_BYTES:
                self._full = True
            else:
                append_line(self._path, content)
        except OSError as error:
            self._full = True
            log.warning("faults not written", path=str(self._path), fact=error.strerror)
