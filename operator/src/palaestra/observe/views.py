"""What is known of a TrainingJob's objects, as values: the seam between reading and deciding.

Everything here was checked when it was read (`palaestra.observe.reading`): a size has a bound, a time
is a time, and what a pod says of itself is either our protocol or nothing.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any

from palaestra.plan.pod import GRACE_S
from palaestra_protocol.pod.status import Termination, TrainerStatus

Raw = Mapping[str, Any]  # an object as its JSON, of which nothing is believed


class SourceKind(StrEnum):
    """The kinds of object that a job may refer to."""

    CONFIG_MAP = "ConfigMap"
    SECRET = "Secret"
    CLAIM = "PersistentVolumeClaim"


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """An object of the job's namespace that its spec refers to; `field` is the first place that does.

    Two are equal when they name the same object.
    """

    kind: SourceKind
    name: str
    field: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polled:
    """What a trainer answered, and when on this process's monotonic clock."""

    status: TrainerStatus
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Objects:
    """Everything that is read for one TrainingJob, as raw JSON.

    Attributes:
        jobs, pods, claims, config_maps, policies: of its namespace, with its label palaestra.dev/job;
            a Job that was found to have one of our names belongs among `jobs`, whoever owns it.
        events: FailedCreate events about those Jobs, and warnings about pods that wait for volumes.
        unadmitted: by a Job's uid why Kueue has not admitted it, where that was asked for.
        unasked: uids of Jobs and pods that lack something, and about which the operator sends no request.
        polled: the last answers of trainers by pod UID; a pod that was not reached is absent.
        denied: what the API server said when it last refused an object of a replica; None: an object of
            the whole job. Absent: nothing is refused.
        switchers: by a Job's uid the field manager that set its `spec.suspend`, where it is not as the
            operator set it.
    """

    jobs: Sequence[Raw] = ()
    pods: Sequence[Raw] = ()
    claims: Sequence[Raw] = ()
    config_maps: Sequence[Raw] = ()
    policies: Sequence[Raw] = ()
    events: Sequence[Raw] = ()
    unadmitted: Mapping[str, str] = field(default_factory=dict)
    unasked: frozenset[str] = frozenset()
    polled: Mapping[str, Polled] = field(default_factory=dict)
    denied: Mapping[int | None, str] = field(default_factory=dict)
    switchers: Mapping[str, str] = field(default_factory=dict)


class ContainerKind(StrEnum):
    """What a container is in its pod."""

    MAIN = "main"
    SIDECAR = "sidecar"
    INIT = "init"


@dataclass(frozen=True, slots=True, kw_only=True)
class Exit:
    """How a container ended; `message` is its termination message, as the pod wrote it."""

    code: int
    reason: str = ""
    message: str = ""
    at: datetime | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerView:
    """One container of a pod.

    Attributes:
        running_since: None: it does not run now.
        started: its startup probe has passed, or it has none and runs.
        waiting, waiting_message: why it does not run yet, in the kubelet's words; "": it does not wait.
        exit: how it ended, if it has; of a sidecar that runs again, how it ended before.
        restarts: by the kubelet.
        memory_limit: as its spec has it; "": none.
    """

    name: str
    kind: ContainerKind
    image: str = ""
    running_since: datetime | None = None
    started: bool = False
    waiting: str = ""
    waiting_message: str = ""
    exit: Exit | None = None
    restarts: int = 0
    memory_limit: str = ""

    @property
    def ended_run(self) -> int:
        """Return which run of the container `exit` is the end of, from 0."""
        return self.restarts if self.running_since is None else max(self.restarts - 1, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PodView:
    """One pod of a replica.

    Attributes:
        version: its resourceVersion.
        started: when a kubelet took it.
        phase: Pending, Running, Succeeded, Failed or Unknown.
        reason, message: the pod's own, as of an eviction; mostly "".
        ready: the kubelet's word; False: it is not, or nobody knows.
        mounted: its volumes are there: it has begun to pull images, or is past that.
        unschedulable: the scheduler's words; "": it was scheduled.
        disruption: why the cluster took it (condition DisruptionTarget); "": it did not.
        gone_by: when it was to be gone, its grace period included; None: nobody deleted it. A time of the
            API server, so it is compared with no clock of ours.
        grace_s: seconds between its deletion and `gone_by`.
        containers: in the order in which they start, the trainer last.
        claims: names of the PersistentVolumeClaims that it mounts.
    """

    name: str
    uid: str
    created: datetime
    version: str = ""
    phase: str = "Pending"
    started: datetime | None = None
    reason: str = ""
    message: str = ""
    ready: bool = False
    mounted: bool = False
    node: str = ""
    unschedulable: str = ""
    disruption: str = ""
    gone_by: datetime | None = None
    grace_s: int = GRACE_S
    containers: tuple[ContainerView, ...] = ()
    claims: frozenset[str] = frozenset()

    @property
    def ended(self) -> bool:
        """Return whether all its containers have ended for good."""
        return self.phase in {"Succeeded", "Failed"}

    @property
    def trainer(self) -> ContainerView | None:
        """Return its main container, None where the pod shows none."""
        return next((each for each in self.containers if each.kind is ContainerKind.MAIN), None)

    @property
    def sidecars(self) -> tuple[ContainerView, ...]:
        """Return the ROS master's container and those of the simulators."""
        return tuple(each for each in self.containers if each.kind is ContainerKind.SIDECAR)


class JobEnd(StrEnum):
    """How a batch/v1 Job ended."""

    COMPLETE = "Complete"
    FAILED = "Failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced:
    """The mark on a Job whose pod the operator replaces.

    Attributes:
        times: pods that were replaced so, this one among them.
        pod: uid of the last one.
        reason, message: why.
    """

    times: int
    pod: str
    reason: str
    message: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspended:
    """The mark on a Job that the operator has suspended.

    Attributes:
        pod: uid of the current attempt's pod at that time.
        lived: the suspension ended it; False: it had ended, or was being deleted, before.
    """

    pod: str
    lived: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JobView:
    """The batch/v1 Job of a replica.

    Attributes:
        version: its resourceVersion.
        suspended: as its spec says.
        suspend_set: the `spec.suspend` that the operator set last, by its annotation; None: an earlier
            release made the Job, or the Job has a queue.
        suspension: our mark of the pod that our last suspension ended; None: it has none.
        paused: since when it is, by its controller's word; None: it is not.
        resumed: when it last was, by its controller's word; None: it never was suspended or still is.
        stopped: reason and message of our stop mark; None: it has none.
        replaced: our mark of the pods that we replaced; None: it has none.
        failures: pods that failed and count against backoffLimit.
        end, end_reason, end_message: what its conditions say; None and "" while it goes on.
        settings: fields of its spec that others may change; one that it lacks is absent.
        deleting: somebody deleted it.
        volumes: names of the ConfigMaps and claims that its pods mount.
        queue: the queue that Kueue knows it by, from the spec or a namespace's default; "": it has none.
    """

    name: str
    uid: str
    version: str = ""
    suspended: bool = False
    suspend_set: bool | None = None
    suspension: Suspended | None = None
    paused: datetime | None = None
    resumed: datetime | None = None
    stopped: tuple[str, str] | None = None
    replaced: Replaced | None = None
    failures: int = 0
    end: JobEnd | None = None
    end_reason: str = ""
    end_message: str = ""
    settings: Mapping[str, int] = field(default_factory=dict)
    deleting: bool = False
    volumes: frozenset[str] = frozenset()
    queue: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A Job that has our name and is not ours; `deleting`: it will be gone."""

    name: str
    deleting: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CreateFailure:
    """The last time the API server refused a pod, in its words."""

    message: str
    at: datetime


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaObserved:
    """What the cluster shows of one replica.

    Attributes:
        pods: those of its Job, and the one that the status names; oldest first.
        in_the_way: names of all other pods that say they are the replica's and have not ended. What they
            tell is not believed; they may write to its volume all the same.
        former: pods of an earlier TrainingJob of the same name that have not ended and mount the existing
            claim that this replica is to mount.
        polled: the answer of the newest pod's trainer; None: unknown.
        terminations: last words of trainers by pod UID, those that are of our protocol.
        refused: why no pod could be made, if that is newer than the newest pod.
        denied: why an object of the replica could not be made; "": it could.
        unmounted: why the newest pod's volumes are not there, in the cluster's words; "": they are, or
            nobody said so.
        unadmitted: why Kueue has not admitted the Job; "": it has, or gives no reason; None: not asked yet.
        unasked: its pod, the pod's volumes or Kueue's admission are missing, and the operator sends no
            request about it.
        switcher: the field manager that set the Job's `spec.suspend`, where it is not as the operator set it;
            "": it is, or the manager is unknown.
    """

    index: int
    job: JobView | None = None
    obstacle: Obstacle | None = None
    pods: tuple[PodView, ...] = ()
    in_the_way: tuple[str, ...] = ()
    former: tuple[PodView, ...] = ()
    polled: Polled | None = None
    terminations: Mapping[str, Termination] = field(default_factory=dict)
    refused: CreateFailure | None = None
    denied: str = ""
    unmounted: str = ""
    unadmitted: str | None = None
    unasked: bool = False
    switcher: str = ""

    @property
    def pod(self) -> PodView | None:
        """Return the newest pod."""
        return self.pods[-1] if self.pods else None

    @property
    def termination(self) -> Termination | None:
        """Return the last word of the newest pod's trainer."""
        return self.terminations.get(self.pod.uid) if self.pod else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """What the cluster shows of a TrainingJob.

    `sources` and `kueue` are asked for only while something of the job is missing, which `observe` shows:
    the operator adds them.

    Attributes:
        replicas: one for each replica of the spec, by index.
        present: kind and name of the ConfigMaps, claims and NetworkPolicies that there are.
        edited: name and generation of each NetworkPolicy whose spec was changed since it was made.
        sources: what `references(job)` names; None: there is no such object. Of a Secret the
            metadata is enough.
        kueue: whether the cluster has Kueue.
    """

    replicas: tuple[ReplicaObserved, ...]
    present: frozenset[tuple[str, str]] = frozenset()
    edited: tuple[tuple[str, int], ...] = ()
    sources: Mapping[Source, Raw | None] = field(default_factory=dict)
    kueue: bool = False
