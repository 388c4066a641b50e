"""Trials in a cluster: TrainingJobs with a common label, which the operator and a queue run.

The command creates these jobs, reads their status, and deletes the jobs of pruned trials. The jobs continue
if the command ends.
"""

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TypeVar

from palaestra.api import TrainingJob
from palaestra.api.attempt_status import LastEvaluation
from palaestra.api.status import TERMINAL, Phase, ReplicaStatus
from palaestra.client import Client, ClientError, NoSuchJob
from palaestra.client.wait_progress import current
from palaestra.cluster.errors import Gone, ServerError, TooManyRequests, Unreachable
from palaestra.errors import PalaestraError
from palaestra.sweeps.model import LABEL
from palaestra.sweeps.trial import Point, RunFigures, Trial, TrialFigures, TrialProgress, with_evaluation

LOOK_S = 5.0  # seconds between two requests; the operator writes progress at most every 30 s
DELETED_S = 300.0
AWAY = (Gone, ServerError, TooManyRequests, Unreachable)
QUIET_LOOKS = 6  # failed requests in a row before a line reports them: at least half a minute

Answer = TypeVar("Answer")


class NotOfThisSweep(ClientError):
    """A job with a trial's name exists, but does not belong to the sweep."""


class ClusterBackend:
    """The TrainingJobs of a sweep in a namespace.

    Args:
        client: the client for the cluster and namespace.
        sweep: the name of the sweep.
        at_once: number of trials at the same time; None: all trials, and the job's queue decides.
        report: called with a line when the API server has not responded for half a minute, and when it
            responds again.
        look_s: seconds between two requests.
    """

    def __init__(
        self,
        client: Client,
        sweep: str,
        at_once: int | None,
        report: Callable[[str], object],
        look_s: float = LOOK_S,
    ) -> None:
        self._client = client
        self._selector = f"{LABEL}={sweep}"
        self._at_once = at_once
        self._report = report
        self._look_s = look_s
        self._answered = False
        self._begun: set[int] = set()
        self._jobs: Mapping[str, TrainingJob] = {}
        self._curves: dict[tuple[int, int], tuple[Point, ...]] = {}

    def check(self, job: TrainingJob) -> None:
        """Check that the job of a trial is for the namespace.

        Raises:
            PalaestraError: the job names another namespace.
        """
        named = job.metadata.namespace if "namespace" in job.metadata.model_fields_set else None
        if named not in {None, self._client.namespace}:
            raise PalaestraError(
                f"metadata.namespace: is {named}, but the sweep creates its jobs in namespace "
                f"{self._client.namespace}; choose the namespace with -n"
            )

    def has_room(self) -> bool:
        """Return whether another trial can begin."""
        return self._at_once is None or len(self._begun) < self._at_once

    def begin(self, trial: Trial) -> None:
        """Create the job of a trial if the job does not exist.

        Raises:
            NotOfThisSweep: a job of this name does not belong to the sweep.
            ApiError: the API server refuses the job, or does not respond to the first request of this
                command.
        """
        self._answer_of(lambda: self._create(trial))
        self._begun.add(trial.number)

    def wait(self) -> None:
        """Wait some seconds, then read the status of each job; retry while the server does not respond."""
        time.sleep(self._look_s)
        jobs = self._answer_of(lambda: self._client.list(self._selector))
        self._jobs = {job.metadata.name: job for job in jobs}

    def look(self, trial: Trial) -> TrialFigures:
        """Return the figures of a trial from the status of its job; a deleted job counts as failed."""
        job = self._jobs.get(trial.name)
        if job is None:
            self._begun.discard(trial.number)
            return TrialFigures(state=TrialProgress.FAILED)
        runs = tuple(self._figures(trial, replica) for replica in job.status.replicas)
        if not current(job) or job.status.phase not in TERMINAL:
            return TrialFigures(state=TrialProgress.RUNNING, runs=runs)
        self._begun.discard(trial.number)
        done = job.status.phase is Phase.SUCCEEDED
        return TrialFigures(state=TrialProgress.COMPLETE if done else TrialProgress.FAILED, runs=runs)

    def prune(self, trial: Trial) -> None:
        """Delete the job of a trial, if it exists, and wait until its pods have ended."""
        self._begun.discard(trial.number)
        self._answer_of(lambda: self._delete(trial))

    def _create(self, trial: Trial) -> None:
        with suppress(NoSuchJob):
            found = self._client.get(trial.name)
            if found.metadata.labels.get(LABEL) != trial.job.metadata.labels[LABEL]:
                raise NotOfThisSweep(
                    f"job {trial.name}: already exists in namespace {self._client.namespace}, but not for "
                    "this sweep; give the sweep another name"
                )
        self._client.apply(trial.job)

    def _delete(self, trial: Trial) -> None:
        with suppress(NoSuchJob):
            self._client.delete(trial.name, deadline_s=DELETED_S)

    def _answer_of(self, ask: Callable[[], Answer]) -> Answer:
        """Return the response of the API server; retry while it does not respond.

        A server that has never responded may be the wrong server, so then the first error is raised.
        """
        looks = 0
        while True:
            try:
                answer = ask()
                break
            except AWAY as error:
                if not self._answered:
                    raise
                looks += 1
                if looks == QUIET_LOOKS:
                    self._report(
                        f"the API server has not responded for a while ({error}); "
                        "the trials continue, and this command retries"
                    )
            time.sleep(self._look_s)
        self._answered = True
        if looks >= QUIET_LOOKS:
            self._report("the API server responds again")
        return answer

    def _figures(self, trial: Trial, status: ReplicaStatus) -> RunFigures:
        """Return the figures of a replica; each new evaluation adds a point to the replica's curve.

        The replica's own mean return is that of training episodes, which include exploration. So it is never
        a point, and a trainer that does not report evaluations has no curve.
        """
        return RunFigures(
            curve=self._curve((trial.number, status.index), status.last_evaluation),
            success_rate=status.success_rate,
            ended=status.phase in TERMINAL,
            succeeded=status.phase is Phase.SUCCEEDED,
            reason=status.message or "",
        )

    def _curve(self, run: tuple[int, int], evaluation: LastEvaluation | None) -> tuple[Point, ...]:
        """Return the curve of a run, with a point for each evaluation that this command has read."""
        curve: tuple[Point, ...] = ()
        if evaluation is not None:
            newest = Point(
                step=evaluation.step,
                success_rate=evaluation.success_rate,
                mean_return=evaluation.mean_return,
            )
            curve = with_evaluation(self._curves.get(run, ()), newest)
        self._curves[run] = curve
        return curve
