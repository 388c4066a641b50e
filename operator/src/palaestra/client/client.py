"""The client, which has one method for each operation on the TrainingJobs of a cluster."""

import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Literal, Self

from palaestra.api import Spec, Status, TrainingJob, validate
from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, PodReference
from palaestra.client.errors import (
    EndedOtherwise,
    HasEnded,
    NoPod,
    NoSuchJob,
    NothingLost,
    QueueDecides,
    asked,
)
from palaestra.client.events import Event, events_about
from palaestra.client.fetch import fetch
from palaestra.client.wait_progress import News, current, why
from palaestra.client.watch import changes
from palaestra.cluster import Api, Invalid, NotFound, connect, namespace_of
from palaestra.cluster.resources import TRAINING_JOBS
from palaestra.job_input import Given, data_of, name_of
from palaestra.objects import Object
from palaestra.plan import ClusterLayout, Images
from palaestra.plan.replica import RESTART_LOST_RUNS, ROS_MASTER, TRAINER, Replica

MANAGER = "palaestra"
FETCH_S = 600.0

Until = Literal["ended", "Running", "Suspended", "Succeeded", "Failed"]


class Client:
    """The TrainingJobs of one namespace of a cluster; several threads may use one client.

    Attributes:
        api: the connection to the cluster, for requests about other objects.
        namespace: the namespace of all jobs that this client creates or finds.
    """

    def __init__(
        self, *, namespace: str | None = None, kubeconfig: str | None = None, context: str | None = None
    ) -> None:
        """Choose a cluster; the constructor sends no request.

        Args:
            namespace: the namespace of the jobs; None for the namespace of the context, or of the pod.
            kubeconfig: the kubeconfig file; None for $KUBECONFIG, then ~/.kube/config, then the pod's service
                account.
            context: the context of the kubeconfig; None for the current context.

        Raises:
            NotConfigured: no API server is configured, or its credentials cannot be read.
        """
        self.api: Api = connect(kubeconfig, context)
        self.namespace = namespace or namespace_of(kubeconfig, context)

    def __enter__(self) -> Self:
        """Return the client."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close all connections."""
        self.close()

    def close(self) -> None:
        """Close all idle connections."""
        self.api.close()

    def apply(self, job: Given) -> TrainingJob:
        """Create a job, or change its mutable fields, and return the stored job.

        Args:
            job: the job as an object, plain data, YAML text, or the path of a file. The cluster sets the
                absent fields to their defaults.

        Raises:
            SpecErrors: the job is invalid; the error lists every problem. No request was sent.
            OSError: the file cannot be read.
            ApiError: the API server refuses, for example a change of an immutable field.
        """
        data = data_of(job)
        validate(data, name_of(job))
        metadata = {"namespace": self.namespace, **data["metadata"]}
        # If this client applied an empty spec twice, the second server-side apply would remove the spec.
        spec = data["spec"] or {"replicas": Spec().replicas}
        with asked(None, self.namespace):
            return _job(self.api.apply({**data, "metadata": metadata, "spec": spec}, manager=MANAGER))

    def get(self, name: str) -> TrainingJob:
        """Return the current state of a job.

        Raises:
            NoSuchJob: no job has this name.
            SpecErrors: this release cannot read the job, which another release wrote.
        """
        return _job(self.raw(name))

    def list(self, labels: str | None = None) -> tuple[TrainingJob, ...]:
        """Return all jobs of the namespace, or only the jobs that match a label selector."""
        with asked(None, self.namespace):
            return tuple(_job(job) for job in self.api.list(TRAINING_JOBS, self.namespace, labels=labels))

    def raw(self, name: str) -> Object:
        """Return a job as plain data, in the form that the API server stores.

        Raises:
            NoSuchJob: no job has this name.
        """
        with asked(name, self.namespace):
            return self.api.get(TRAINING_JOBS, self.namespace, name)

    def changes(self, name: str, *, deadline_s: float) -> Iterator[TrainingJob]:
        """Yield a job, then yield it again after each change, until the job has ended or was deleted.

        Raises:
            NoSuchJob: no job has this name.
            TookTooLong: the job had not ended after `deadline_s`.
        """
        found = None
        deadline = time.monotonic() + deadline_s
        with asked(None, self.namespace):
            for change in changes(self.api, TRAINING_JOBS, self.namespace, name, deadline=deadline):
                found = _job(change)
                yield found
                if current(found) and found.status.phase in TERMINAL:
                    return
        if found is None:
            raise NoSuchJob.of(name, self.namespace)

    def statuses(self, name: str, *, deadline_s: float) -> Iterator[Status]:
        """Yield the status of a job now and after each change; raise the same errors as `changes`."""
        for job in self.changes(name, deadline_s=deadline_s):
            yield job.status

    def wait(
        self,
        name: str,
        *,
        until: Until = "ended",
        deadline_s: float,
        report: Callable[[str], object] | None = None,
    ) -> TrainingJob:
        """Wait until the job reaches a phase or ends, and return the job.

        Args:
            name: the name of the job.
            until: the phase, or `ended`.
            deadline_s: the longest wait in seconds.
            report: a function such as `print` or `logging.info`. The function is called with one line for
                each new phase, and for each new waiting reason of a replica. None: no report.

        Raises:
            EndedOtherwise: the job ended in another phase than `until`.
            NoSuchJob: no job has this name, or it was deleted.
            TookTooLong: the job did not reach the phase within `deadline_s`.
        """
        news = News(name)
        for job in self.changes(name, deadline_s=deadline_s):
            phase = job.status.phase
            if not current(job) or phase is None:
                continue
            if report is not None:
                for line in news.of(phase, job.status):
                    report(line)
            if phase == until or (until == "ended" and phase in TERMINAL):
                return job
            if phase in TERMINAL:
                raise EndedOtherwise(f"job {name}: is {phase}, not {until}: {why(job.status)}")
        raise NoSuchJob.of(name, self.namespace)

    def logs(
        self,
        name: str,
        *,
        replica: int = 0,
        container: str = TRAINER,
        follow: bool = False,
        tail: int | None = None,
        deadline_s: float,
    ) -> Iterator[str]:
        """Yield the lines of a container of a replica's newest pod.

        Args:
            name: the name of the job.
            replica: the number of the replica.
            container: `trainer`, `ros-master`, or `sim-<group>-<number>`.
            follow: whether to wait for further lines until the container has ended.
            tail: number of last lines; None: all lines that the node still has.
            deadline_s: the deadline of the whole call, in seconds.

        Raises:
            NoSuchJob: no job has this name.
            NoPod: the replica has no pod or no such container, or its container did not start.
        """
        job = self.get(name)
        pod = newest_pod(job, replica)
        try:
            yield from self.api.logs(
                self.namespace, pod.name, container, follow=follow, tail=tail, within_s=deadline_s
            )
        except NotFound as error:
            raise NoPod(
                f"pod {pod.name}: does not exist any more, and its log was deleted with it; "
                f"`palaestra describe {name}` shows the last lines of the last attempt"
            ) from error
        except Invalid as error:
            known = _containers(job, replica)
            if container not in known:
                raise NoPod(
                    f"pod {pod.name}: has no container {container}; its containers are {', '.join(known)}"
                ) from error
            raise NoPod(
                f"pod {pod.name}: {error.message}; `palaestra describe {name}` shows what the pod waits for"
            ) from error

    def events(self, name: str) -> tuple[Event, ...]:
        """Return the events about a job and about the objects created for the job, oldest first.

        Raises:
            NoSuchJob: no job has this name.
        """
        return events_about(self.api, self.get(name))

    def suspend(self, name: str) -> TrainingJob:
        """Suspend a job: its pods save a checkpoint and are deleted; raise the same errors as `resume`."""
        _check_running(self.get(name), "suspended")
        try:
            return self._suspended(name, suspend=True)
        except Invalid as error:
            _check_queue(self.get(name), error)
            raise

    def resume(self, name: str) -> TrainingJob:
        """Resume a suspended job.

        Raises:
            NoSuchJob: no job has this name.
            HasEnded: the job has ended; nothing was changed.
            QueueDecides: the job is in a Kueue queue.
        """
        _check_running(self.get(name), "resumed")
        job = self._suspended(name, suspend=False)
        _check_queue(job)
        return job

    def restart(self, name: str) -> TrainingJob:
        """Restart those replicas of a job that have lost their runs, from the content of the run directories.

        A replica starts at step 0 again if its run directory is empty or its claim does not exist.

        Raises:
            NoSuchJob: no job has this name.
            HasEnded: the job has ended; nothing was changed.
            NothingLost: no replica of the job has lost its run; nothing was changed.
        """
        job = self.get(name)
        _check_running(job, "restarted")
        if not any(replica.reason == Reason.RUN_LOST for replica in job.status.replicas):
            raise NothingLost.of(name)
        word = {"metadata": {"annotations": {RESTART_LOST_RUNS: datetime.now(UTC).isoformat()}}}
        with asked(name, self.namespace):
            return _job(self.api.merge(TRAINING_JOBS, self.namespace, name, word))

    def delete(self, name: str, *, deadline_s: float | None = None) -> None:
        """Delete a job and its pods; with a deadline, wait until they are deleted.

        With `retain: Keep`, claims stay.

        Raises:
            NoSuchJob: no job has this name.
            TookTooLong: the job still exists after `deadline_s`.
        """
        uid = self.raw(name)["metadata"]["uid"]
        propagation = "Background" if deadline_s is None else "Foreground"
        with asked(name, self.namespace):
            self.api.delete(TRAINING_JOBS, self.namespace, name, uid=uid, propagation=propagation)
        if deadline_s is not None:
            deadline = time.monotonic() + deadline_s
            for _ in changes(self.api, TRAINING_JOBS, self.namespace, name, deadline=deadline, uid=uid):
                pass

    def fetch(
        self,
        name: str,
        *,
        replica: int = 0,
        into: str | Path,
        deadline_s: float = FETCH_S,
        most_bytes: int | None = None,
    ) -> Path:
        """Copy policy, report and TensorBoard data of a run, and return the folder `into/<job>/<replica>`.

        The user needs the permissions to create and delete pods and to run commands in them. The data from
        the pod is untrusted, so `most_bytes` limits its size. The default is four times the volume that the
        job requests.

        Raises:
            NoSuchJob: no job has this name.
            NotFetched: the folder exists already, or the run does not exist or cannot be read.
            TookTooLong: `deadline_s` passed; no file was written.
        """
        deadline = time.monotonic() + deadline_s
        return fetch(self.api, self.get(name), replica, Path(into), deadline=deadline, most_bytes=most_bytes)

    def _suspended(self, name: str, *, suspend: bool) -> TrainingJob:
        with asked(name, self.namespace):
            return _job(self.api.merge(TRAINING_JOBS, self.namespace, name, {"spec": {"suspend": suspend}}))


def newest_pod(job: TrainingJob, replica: int) -> PodReference:
    """Return the newest pod of a replica.

    Raises:
        NoPod: the replica has no pod.
    """
    pod = next((known.pod for known in job.status.replicas if known.index == replica), None)
    if pod is None:
        name = job.metadata.name
        raise NoPod(
            f"job {name}: replica {replica} has no pod; the job has "
            f"{job.spec.replicas} replicas, and `palaestra describe {name}` shows why replicas wait"
        )
    return pod


def _containers(job: TrainingJob, replica: int) -> tuple[str, ...]:
    """Return the names of a replica's containers whose logs people read."""
    layout = ClusterLayout(images=Images.of_release(version("palaestra")))
    simulators = Replica(job=job, index=replica, layout=layout).simulators
    return (TRAINER, ROS_MASTER, *(simulator.container for simulator in simulators))


def _check_running(job: TrainingJob, verb: str) -> None:
    """Check that the job has not ended.

    Raises:
        HasEnded: the job has ended.
    """
    phase = job.status.phase
    if phase is not None and phase in TERMINAL:
        raise HasEnded.of(job.metadata.name, phase.value, verb)


def _check_queue(job: TrainingJob, refusal: Invalid | None = None) -> None:
    """Check that the job has no queue.

    Raises:
        QueueDecides: the job has a queue; the API server's `refusal`, if given, is the cause.
    """
    queue = job.spec.scheduling.queue_name
    if queue is not None:
        raise QueueDecides.of(job.metadata.name, job.metadata.namespace, queue) from refusal


def _job(found: Object) -> TrainingJob:
    return validate(found, found["metadata"]["name"])
