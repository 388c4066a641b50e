"""The faults of a run as lines of a file: one per fault, and one when the simulator is up again.

A line is written at once, so a fault is known even if the run is killed before the simulator is up.
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

MOST_BYTES = 2**20  # the limit of the file; the counters of the run count every fault


class FaultLog:
    """The file of one attempt; callable from any thread.

    A full disk is logged once and ends nothing here: the next checkpoint reports it.

    Args:
        path: the file; it may be missing.
        attempt: number of the attempt.
        clock: returns seconds from any starting point.
    """

    def __init__(self, path: Path, attempt: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._path = path
        self._attempt = attempt
        self._clock = clock
        self._lock = threading.Lock()
        self._down: dict[str, list[float]] = {}  # times of the faults of each simulator that is down
        self._full = False

    def broke(self, fault: FaultRecord, steps_lost: int) -> None:
        """Record a fault and the steps of the episode that it truncated."""
        with self._lock:
            self._down.setdefault(fault.simulator, []).append(self._clock())
            self._write(fault.to_json() | {"attempt": self._attempt, "steps_lost": steps_lost})

    def is_up(self, simulator: str) -> None:
        """Record that a simulator is up, if it was down."""
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
