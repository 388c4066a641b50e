"""One trial of a sweep, and the figures of its runs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from statistics import median
from typing import Any, Self

from palaestra.api import TrainingJob
from palaestra.sweeps.model import Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """The changed fields with their values, and the job with these values and a replica for each seed."""

    number: int
    changes: Mapping[str, Any]
    job: TrainingJob

    @property
    def name(self) -> str:
        """Return the name of the job."""
        return self.job.metadata.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """The figures of one evaluation; a figure is None if it was not reported."""

    step: int
    success_rate: float | None
    mean_return: float | None

    def value(self, objective: Objective) -> float | None:
        """Return the figure of the objective."""
        return self.success_rate if objective is Objective.SUCCESS_RATE else self.mean_return


def with_evaluation(curve: tuple[Point, ...], newest: Point) -> tuple[Point, ...]:
    """Return the evaluations of a run with its newest evaluation at the end.

    A resumed run repeats the evaluations after its checkpoint, so later points of `curve` are dropped.
    """
    return (*(point for point in curve if point.step < newest.step), newest)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunFigures:
    """One run of a trial: its evaluations in order, and its result; `success_rate` may be unknown (None).

    `reason` is the reason for the run's end; empty: the run has not ended, or the reason is unknown.
    """

    curve: tuple[Point, ...] = ()
    success_rate: float | None = None
    ended: bool = False
    succeeded: bool = False
    reason: str = ""

    def at(self, step: int, objective: Objective) -> float | None:
        """Return the newest figure up to `step`; None if the curve ends before it or begins after it."""
        if not self.curve or self.curve[-1].step < step:
            return None
        newest = next((point for point in reversed(self.curve) if point.step <= step), None)
        return None if newest is None else newest.value(objective)

    def aligned(self, every: int) -> Self:
        """Return the run with the step of each evaluation rounded down to a multiple of `every` steps.

        A run evaluates at the end of the rollout that passes a multiple of `evaluation.everySteps`.
        """
        points = (replace(point, step=point.step // every * every) for point in self.curve)
        return replace(self, curve=tuple(points))

    def value(self, objective: Objective) -> float | None:
        """Return the final policy's figure if it was measured, else the figure of the last evaluation."""
        if objective is Objective.SUCCESS_RATE and self.success_rate is not None:
            return self.success_rate
        return self.curve[-1].value(objective) if self.curve else None


class TrialProgress(StrEnum):
    """The state of a trial."""

    WAITING = "waiting"
    RUNNING = "running"
    COMPLETE = "complete"
    FAILED = "failed"
    PRUNED = "pruned"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialFigures:
    """The runs of a trial in the order of their seeds, and the state of the trial."""

    state: TrialProgress
    runs: tuple[RunFigures, ...] = ()

    @classmethod
    def of(cls, runs: tuple[RunFigures, ...]) -> Self:
        """Return the figures of a trial from its runs, for a trial that was not pruned."""
        if not all(run.ended for run in runs):
            return cls(state=TrialProgress.RUNNING, runs=runs)
        done = all(run.succeeded for run in runs)
        return cls(state=TrialProgress.COMPLETE if done else TrialProgress.FAILED, runs=runs)

    def reasons(self) -> tuple[str, ...]:
        """Return the reasons of failed runs, each once."""
        failed = (run for run in self.runs if run.ended and not run.succeeded)
        return tuple(dict.fromkeys(run.reason for run in failed if run.reason))

    def lacks(self, objective: Objective) -> bool:
        """Return whether all runs were evaluated, but without a figure for the objective."""
        return all(run.curve for run in self.runs) and bool(self.runs) and not self.values(objective)

    def values(self, objective: Objective) -> tuple[float, ...]:
        """Return the known results of the runs."""
        return tuple(value for run in self.runs if (value := run.value(objective)) is not None)

    def median(self, objective: Objective) -> float | None:
        """Return the median of the known results; None without results."""
        values = self.values(objective)
        return median(values) if values else None

    def common(self, objective: Objective) -> Mapping[int, float]:
        """Return the median over all seeds by step, for all steps that every run has reached."""
        steps = {point.step for run in self.runs for point in run.curve}
        values = {step: self.at(step, objective) for step in sorted(steps)}
        return {step: median(found) for step, found in values.items() if len(found) == len(self.runs)}

    def on_grid(self, every: int, objective: Objective) -> Mapping[int, float]:
        """Return the median over all seeds at each multiple of `every` steps that every run has reached.

        Trials evaluate at different steps, and a reader may miss evaluations. So the steps are rounded down,
        and a multiple without an evaluation has the newest figure before it. A multiple before the first
        evaluation of a run has no median.
        """
        found = replace(self, runs=tuple(run.aligned(every) for run in self.runs))
        reached = min((run.curve[-1].step if run.curve else -1 for run in found.runs), default=-1)
        values = {step: found.at(step, objective) for step in range(0, reached + 1, every)}
        return {step: median(known) for step, known in values.items() if len(known) == len(self.runs)}

    def at(self, step: int, objective: Objective) -> tuple[float, ...]:
        """Return the newest figure up to a step for each run that has reached the step."""
        values = (run.at(step, objective) for run in self.runs)
        return tuple(value for value in values if value is not None)
