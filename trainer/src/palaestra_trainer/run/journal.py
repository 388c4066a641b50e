"""Write the counters of a run every few seconds, for the attempt after a kill.

A killed process cannot save a checkpoint. The next attempt repeats the steps after the last checkpoint, but
the time and the faults of the killed process still count. So the counters are also written to this file. The
write does not wait for the disk. A kill does not lose the written data, and a crash of the machine loses only
data that a resume does not need.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import structlog

from palaestra_trainer.run.telemetry.progress import Counters, Progress

log = structlog.get_logger(__name__)

EVERY_S = 5.0


class Journal:
    """The file journal.json of a run directory.

    Args:
        path: the file; it may be missing.
        clock: a function that returns seconds from any starting point.
    """

    def __init__(self, path: Path, clock: Callable[[], float] = time.monotonic) -> None:
        self._path = path
        self._clock = clock
        self._next = clock() + EVERY_S

    def keep(self, progress: Progress) -> None:
        """Write the counters to the file, at most every `EVERY_S` seconds."""
        if self._clock() < self._next:
            return
        content = {"step": progress.step, "counters": progress.counted().to_json()}
        draft = self._path.with_name(f".{self._path.name}")
        try:
            draft.write_text(json.dumps(content), encoding="utf-8")
            draft.rename(self._path)
        except OSError as error:
            log.warning("journal not written", path=str(self._path), fact=error.strerror)
        self._next = self._clock() + EVERY_S

    def regained(self, step: int, saved: Counters) -> Counters:
        """Return the counters of a run that resumes from `step`.

        If the run continued after `step` without a new checkpoint, most counters come from the journal,
        because time and faults still count. Otherwise the result is `saved`, the counters of the checkpoint.
        """
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
            reached, later = int(content["step"]), Counters.from_json(content["counters"])
        except (OSError, ValueError, TypeError, KeyError, OverflowError):
            return saved
        if later.seconds <= saved.seconds:
            return saved
        return replace(
            later,
            episodes=saved.episodes,
            extra_steps=saved.extra_steps,
            steps_lost=later.steps_lost + max(reached - step, 0),
        )
