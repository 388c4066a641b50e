"""Serve the reports of a user's own training program (`trainer.command`) in /status and /metrics.

The built-in training loop does not need these reports. If a user's program does not report, the operator does
not know its steps. The operator then cannot detect progress between preempted attempts, and ends the replica
as `NoProgress`.
"""

from __future__ import annotations

import multiprocessing
import os
import threading
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from functools import cache
from typing import Any

from palaestra_protocol.pod.enums import Role
from palaestra_protocol.pod.status import Cause, EvaluationStatus, Termination
from palaestra_trainer.environments.infos import ours
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, Configuration, load
from palaestra_trainer.run.telemetry.metrics import constants
from palaestra_trainer.run.telemetry.progress import Counters, Progress
from palaestra_trainer.run.telemetry.status_server import status_server
from palaestra_trainer.run.termination import write_last_word

_lock = threading.Lock()
_EVALUATING_S = 60.0  # longer than any step of an environment takes


class ProgramReport(Progress):
    """The progress of a user's own program, without its time by cause.

    The step is the step that the program reports. Before the first report, the step is the number of steps in
    the program's fault-tolerant environments in this attempt.
    """

    _reports = _evaluates = False

    @property
    def phase(self) -> str:
        """The phase: "evaluating" if an evaluating environment made the last step recently, else "training".

        With this phase the operator can distinguish an evaluation from stalled training.
        """
        return "evaluating" if self._evaluates and self.idle_s() < _EVALUATING_S else "training"

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Do not measure time, because any thread of the program may wait for simulators."""
        del cause
        return nullcontext()

    def counted(self, kept: int | None = None) -> Counters:
        """Return the current counters, without the time by cause."""
        return replace(super().counted(kept), goodput={})

    def reports(self, step: int, success_rate: float | None) -> None:
        """Set the step, and the success rate unless it is None."""
        self._reports, self.step = True, step
        self.stepped(1)
        if success_rate is not None:
            self.success_rate = success_rate
            self.last_evaluation = EvaluationStatus(step=step, success_rate=success_rate)

    def played(self, role: Role, infos: Sequence[Mapping[str, Any]]) -> None:
        """Count a step of collecting environments by the infos of its rows; ignore other environments."""
        valid = sum("sim_fault" not in ours(info) for info in infos)
        if valid:
            self.stepped(valid)
        self._evaluates = role is Role.EVALUATE
        if not self._evaluates:
            self.collected(self.step if self._reports else self.step + valid, infos)


def report(step: int, success_rate: float | None) -> None:
    """Implement `palaestra_trainer.report`."""
    if step < 0:
        raise ValueError(f"step: {step} is negative; give the number of environment steps so far")
    if success_rate is not None and not 0 <= success_rate <= 1:
        raise ValueError(f"success_rate: {success_rate} is not a share; give a number from 0 to 1")
    if not os.environ.get(CONFIG_VARIABLE):
        return
    with _lock:
        progress = _served()
        progress.reports(step, success_rate)
    if step >= progress.target:
        done = "Completed: all steps are done"
        rate, evaluation = progress.success_rate, progress.last_evaluation
        word = Termination(step=step, reason=done, success_rate=rate, last_evaluation=evaluation)
        write_last_word(word)


def reported(configuration: Configuration) -> ProgramReport:
    """Return the progress to which the environments of this process add their steps.

    A worker process of the program counts separately, and /status does not show its counts.
    """
    if multiprocessing.parent_process() is None:
        with _lock:
            return _served()
    return ProgramReport(configuration.steps, [])


@cache
def _served() -> ProgramReport:
    """Return the progress of this process; the first call also starts the status server."""
    configuration = load()
    progress = ProgramReport(configuration.steps, [])
    status_server(configuration.status_address, progress, constants(configuration)).start()
    return progress
