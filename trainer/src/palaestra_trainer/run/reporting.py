"""Reports of a user's own training program (`trainer.command`), for /status, /metrics and the operator.

The built-in loop reports by itself. Without reports the operator does not see a program's steps. It then
cannot detect progress between preempted attempts, and ends the replica as `NoProgress`.
"""

from __future__ import annotations

import os
import threading
from dataclasses import replace
from functools import cache

from palaestra_protocol.pod.status import Termination
from palaestra_trainer.configuration import CONFIG_VARIABLE, load
from palaestra_trainer.run.termination import write_last_word
from palaestra_trainer.telemetry.metrics import constants
from palaestra_trainer.telemetry.progress import Counters, Progress
from palaestra_trainer.telemetry.status_server import status_server

_lock = threading.Lock()


class _Reported(Progress):
    """The progress of a user's own program; how it spends its time is unknown."""

    @property
    def phase(self) -> str:
        return "training"

    def counted(self, kept: int | None = None) -> Counters:
        return replace(super().counted(kept), goodput={})


def report(step: int, success_rate: float | None) -> None:
    """Report as `palaestra_trainer.report` describes."""
    if step < 0:
        raise ValueError(f"step: {step} is negative; give the number of environment steps learned from")
    if success_rate is not None and not 0 <= success_rate <= 1:
        raise ValueError(f"success_rate: {success_rate} is not a share; give a number from 0 to 1")
    if not os.environ.get(CONFIG_VARIABLE):
        return
    with _lock:
        progress = _served()
        progress.step = step
        progress.stepped(1)
        if success_rate is not None:
            progress.success_rate = success_rate
    if step >= progress.target:
        done = "Completed: all steps are done"
        write_last_word(Termination(step=step, reason=done, success_rate=progress.success_rate))


@cache
def _served() -> _Reported:
    """Return the progress of this process; the first call starts the status server."""
    configuration = load()
    progress = _Reported(configuration.steps, [])
    status_server(configuration.status_address, progress, constants(configuration)).start()
    return progress
