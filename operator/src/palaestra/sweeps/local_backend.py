"""Trials on this machine: as many runs in the background as the processors allow.

The trainer and its collecting simulators take turns, and evaluating simulators are idle meanwhile. So a run
keeps as many processors busy as it has collecting simulators.
"""

import json
import os
import select
from collections import deque
from importlib.metadata import version
from pathlib import Path
from typing import Any

from palaestra.api import Role, TrainingJob
from palaestra.local.outcome import RunOutcome
from palaestra.local.run import RunOptions, check
from palaestra.local.run_directory import job_directory, uid_of
from palaestra.local.run_handle import STOP_S, RunHandle, run
from palaestra.plan import identified
from palaestra.sweeps.trial import Point, RunFigures, Trial, TrialFigures

LOOK_S = 1.0
_Unit = tuple[Trial, int]


class LocalBackend:
    """The runs of a sweep on this machine.

    Args:
        folder: folder of the sweep.
        at_once: number of runs at the same time; None: as many as the processors allow.

    Attributes:
        stopped: whether `stop` has completed, so that all runs have ended.
    """

    def __init__(self, folder: Path, at_once: int | None) -> None:
        self._folder = folder
        self._at_once = at_once
        self.stopped = False
        self._waiting: deque[_Unit] = deque()
        self._running: dict[tuple[int, int], RunHandle] = {}
        self._busy: dict[tuple[int, int], int] = {}

    def check(self, job: TrainingJob) -> None:
        """Run all checks of a trial that do not write files.

        Raises:
            LocalError: the job cannot be run here.
            PlanError: the job cannot be run on one machine.
        """
        directory = job_directory(self._folder, job.metadata.name)
        options = RunOptions(runs=self._folder, version=version("palaestra"))
        check(identified(job, uid_of(directory)), directory, range(job.spec.replicas), options)

    def has_room(self) -> bool:
        """Return whether a processor is free and no run waits for a processor."""
        return not self._waiting and self._fits(1)

    def begin(self, trial: Trial) -> None:
        """Queue the incomplete runs of a trial, and start as many as the processors allow."""
        for replica in range(trial.job.spec.replicas):
            if not self._complete(trial, replica):
                self._waiting.append((trial, replica))
        self._fill()

    def wait(self) -> None:
        """Wait at most a second until a run has ended."""
        select.select([*self._running.values()], [], [], LOOK_S if self._running else 0.0)
        for key, started in tuple(self._running.items()):
            if started.ended:
                del self._running[key], self._busy[key]
        self._fill()

    def look(self, trial: Trial) -> TrialFigures:
        """Return the figures of a trial from its run directories, even if this command did not begin it."""
        return TrialFigures.of(
            tuple(self._figures(trial, replica) for replica in range(trial.job.spec.replicas))
        )

    def prune(self, trial: Trial) -> None:
        """End the runs of a trial after a checkpoint."""
        self._waiting = deque(unit for unit in self._waiting if unit[0].number != trial.number)
        for (number, _), started in self._running.items():
            if number == trial.number:
                started.interrupt()

    def stop(self) -> None:
        """End all runs, each with a checkpoint; a KeyboardInterrupt meanwhile kills the runs."""
        self._waiting.clear()
        runs = tuple(self._running.values())
        try:
            for started in runs:
                started.interrupt()
            for started in runs:
                started.stop(STOP_S)
            self.stopped = True
        finally:
            for started in runs:
                if not started.ended:
                    started.kill()

    def _fill(self) -> None:
        while self._waiting and self._fits(busy(self._waiting[0][0].job)):
            trial, replica = self._waiting.popleft()
            key = (trial.number, replica)
            self._running[key] = run(trial.job, runs=self._folder, replica=replica)
            self._busy[key] = busy(trial.job)

    def _fits(self, more: int) -> bool:
        if self._at_once is not None:
            return len(self._running) < self._at_once
        return not self._running or sum(self._busy.values()) + more <= len(os.sched_getaffinity(0))

    def _directory(self, trial: Trial, replica: int) -> Path:
        return job_directory(self._folder, trial.name) / str(replica)

    def _complete(self, trial: Trial, replica: int) -> bool:
        outcome = RunOutcome.of(self._directory(trial, replica))
        return outcome is not None and outcome.finished

    def _figures(self, trial: Trial, replica: int) -> RunFigures:
        directory = self._directory(trial, replica)
        underway = (trial.number, replica) in self._running or (trial, replica) in self._waiting
        outcome = None if underway else RunOutcome.of(directory)
        return RunFigures(
            curve=evaluations(directory),
            success_rate=None if outcome is None else outcome.success_rate,
            ended=not underway,
            succeeded=outcome is not None and outcome.finished,
            reason="" if outcome is None else outcome.reason,
        )


def busy(job: TrainingJob) -> int:
    """Return the number of processors that one run of a job keeps busy."""
    return sum(group.count for group in job.spec.simulators if group.role is Role.COLLECT)


def evaluations(directory: Path) -> tuple[Point, ...]:
    """Return the evaluations that a run has written so far, in order."""
    try:
        lines = (directory / "evaluations.jsonl").read_text().split("\n")
    except OSError:  # the file does not exist yet
        return ()
    return tuple(_point(json.loads(line)) for line in lines[:-1])  # the last line is empty or incomplete


def _point(line: dict[str, Any]) -> Point:
    return Point(
        step=line["step"], success_rate=line.get("success_rate"), mean_return=line.get("mean_return")
    )
