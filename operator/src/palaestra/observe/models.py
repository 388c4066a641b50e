"""The observation of a TrainingJob's objects, as values: the interface between reading and deciding.

All values were checked when they were read (`palaestra.observe.json_access`): sizes are bounded, times are
valid, and a pod's report is valid by our protocol or absent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from typing import Any

from palaestra.plan import Verdicts
from palaestra.plan.pod import GRACE_S
from palaestra.plan.replica import ROS_MASTER, SIMULATOR_PREFIX, TRAINER
from palaestra_protocol.pod.status import Termination, TrainerStatus

SIDECARS = (SIMULATOR_PREFIX, ROS_MASTER)  # beginnings of the names of the plan's sidecars

Raw = Mapping[str, Any]  # an object as untrusted JSON


class ReferenceKind(StrEnum):
    """The kinds of objects to which a job may refer."""

    CONFIG_MAP = "ConfigMap"
    SECRET = "Secret"
    CLAIM = "PersistentVolumeClaim"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferencedObject:
    """An object of the job's namespace to which its spec refers; `field` is the first such field.

    Two are equal if they name the same object.
    """

    kind: ReferenceKind
    name: str
    field: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polled:
    """A trainer's answer, and its time on this process's monotonic clock."""

    status: TrainerStatus
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Objects:
    """Everything that is read for one TrainingJob, as raw JSON.

    Attributes:
        jobs, pods, claims, config_maps, policies: of its namespace, with its label palaestra.dev/job;
            a Job of another owner that has one of our names is among `jobs` too.
        events: FailedCreate events about those Jobs, warnings about pods that wait for volumes, and events
            about trainers that the kubelet ended.
        unadmitted: by a Job's uid, why Kueue has not admitted it; absent if that was not requested.
        unasked: uids of Jobs and pods that lack something, and about which the operator sends no request.
        polled: the last answers of trainers by pod UID; a pod that was not reached is absent.
        denied: by replica, the message with which the API server last refused one of its objects; None: an
            object of the whole job. A replica without a refusal is absent.
        switchers: by a Job's uid, the field manager that set its `spec.suspend`, if it is not as the operator
            set it.
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
    """The role of a container in its pod."""

    MAIN = "main"
    SIDECAR = "sidecar"
    INIT = "init"


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerExit:
    """How a container ended; `message` is its termination message, as the pod wrote it."""

    code: int
    reason: str = ""
    message: str = ""
    at: datetime | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerView:
    """One container of a pod.

    Attributes:
        running_since: None if it does not run now.
        started: its startup probe has passed, or it has none and runs.
        waiting, waiting_message: why it does not run yet, in the kubelet's words; "" if it does not wait.
        exit: how it ended, if it has; for a sidecar that runs again, how it ended last.
        restarts: by the kubelet.
        memory_limit: from its spec; "" if there is none.
    """

    name: str
    kind: ContainerKind
    image: str = ""
    running_since: datetime | None = None
    started: bool = False
    waiting: str = ""
    waiting_message: str = ""
    exit: ContainerExit | None = None
    restarts: int = 0
    memory_limit: str = ""

    @property
    def simulates(self) -> bool:
        """Return whether it is the ROS master or a simulator's sidecar, by its name."""
        return self.name.startswith(SIDECARS)

    @property
    def ended_run(self) -> int:
        """Return the number, from 0, of the container's run that `exit` ended."""
        return self.restarts if self.running_since is None else max(self.restarts - 1, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PodView:
    """One pod of a replica.

    Attributes:
        version: its resourceVersion.
        started: when a kubelet accepted it.
        phase: Pending, Running, Succeeded, Failed or Unknown.
        reason, message: the pod's own, for example after an eviction; mostly "".
        ready: by the kubelet; False if it is not, or unknown.
        mounted: its volumes are mounted: it has begun to pull images, or is past that.
        unschedulable: the scheduler's message; "" if it was scheduled.
        disruption: why the cluster interrupted it (condition DisruptionTarget); "" if it did not.
        gone_by: the end of its grace period after a deletion; None if it was not deleted. It is a time of the
            API server, so it is not compared with our clocks.
        grace_s: seconds between its deletion and `gone_by`.
        containers: in the order in which they start.
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
        """Return the trainer's container; None if the pod has none.

        A mesh or an agent may add containers to a pod, also before the trainer.
        """
        return next((container for container in self._main if container.name == TRAINER), None)

    @property
    def keeping(self) -> tuple[str, ...]:
        """Return the containers of others that keep the pod from ending with its trainer."""
        return tuple(
            container.name
            for container in self._main
            if container.name != TRAINER and (container.running_since is not None or container.exit is None)
        )

    @property
    def _main(self) -> tuple[ContainerView, ...]:
        return tuple(container for container in self.containers if container.kind is ContainerKind.MAIN)

    @property
    def sidecars(self) -> tuple[ContainerView, ...]:
        """Return the native sidecars: the ROS master, those of the simulators, and those of others."""
        return tuple(container for container in self.containers if container.kind is ContainerKind.SIDECAR)


class JobEnd(StrEnum):
    """How a batch/v1 Job ended."""

    COMPLETE = "Complete"
    FAILED = "Failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced:
    """The mark on a Job whose pod the operator replaces.

    Attributes:
        times: pods that were replaced this way, including this one.
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
        lived: the suspension ended it; False if it had ended, or was being deleted, before.
    """

    pod: str
    lived: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JobView:
    """The batch/v1 Job of a replica.

    Attributes:
        version: its resourceVersion.
        suspended: `spec.suspend`.
        suspend_set: the `spec.suspend` that the operator set last, by its annotation; None: it has
            none, as a Job that the operator created for a queue.
        suspension: our mark of the pod that our last suspension ended; None: it has none.
        paused: since when it is suspended, by the Job controller; None: it is not.
        resumed: when it was resumed last, by the Job controller; None: it never was suspended or still is.
        stopped: reason and message of our stop mark; None: it has none.
        replaced: our mark of the pods that we replaced; None: it has none.
        failures: pods that failed and count against backoffLimit.
        end, end_reason, end_message: from its conditions; None and "" until it ends.
        settings: fields of its spec that others may change; one that it lacks is absent.
        deleting: it is being deleted.
        volumes: names of the ConfigMaps and claims that its pods mount.
        queue: its Kueue queue, from the spec or a namespace's default; "": it has none.
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
class ForeignJob:
    """A Job of another owner that has one of our names; `deleting`: it is being deleted."""

    name: str
    deleting: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class CreateFailure:
    """The API server's last refusal of a pod, with its message."""

    message: str
    at: datetime


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaObserved:
    """The observation of one replica.

    Attributes:
        pods: those of its Job, and the one that the status names; oldest first.
        in_the_way: names of all other unfinished pods with the replica's labels. Their reports are ignored,
            but they may write to its volume.
        former: unfinished pods of an earlier TrainingJob of the same name that mount the `existingClaim` of
            this replica.
        polled: the answer of the newest pod's trainer; None: unknown.
        terminations: valid termination messages of trainers, by pod UID.
        refused: why no pod could be created, if that is newer than the newest pod.
        denied: why an object of the replica could not be created; "": it could.
        unmounted: why the newest pod's volumes are not mounted, in the cluster's words; "": they are, or no
            event has a reason.
        probe: the failed probe, "liveness" or "startup", for which the kubelet ended the newest pod's
            trainer; "": none, or no event reports it.
        unadmitted: why Kueue has not admitted the Job; "": it has, or gives no reason; None: not asked yet.
        unasked: its pod, the pod's volumes or Kueue's admission are missing, and the operator sends no
            request about it.
        switcher: the field manager that set the Job's `spec.suspend`, if it is not as the operator set it;
            "": it is, or the manager is unknown.
    """

    index: int
    job: JobView | None = None
    obstacle: ForeignJob | None = None
    pods: tuple[PodView, ...] = ()
    in_the_way: tuple[str, ...] = ()
    former: tuple[PodView, ...] = ()
    polled: Polled | None = None
    terminations: Mapping[str, Termination] = field(default_factory=dict)
    refused: CreateFailure | None = None
    denied: str = ""
    unmounted: str = ""
    probe: str = ""
    unadmitted: str | None = None
    unasked: bool = False
    switcher: str = ""

    @property
    def pod(self) -> PodView | None:
        """Return the newest pod."""
        return self.pods[-1] if self.pods else None

    @property
    def termination(self) -> Termination | None:
        """Return the termination message of the newest pod's trainer."""
        return self.terminations.get(self.pod.uid) if self.pod else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """The observation of a TrainingJob.

    The operator adds `sources`, `kueue`, `verdicts` and `worlds_wait`, which it needs only while objects of
    the job are missing.

    Attributes:
        replicas: one for each replica of the spec, by index.
        present: kind and name of the existing ConfigMaps, claims and NetworkPolicies.
        edited: name and generation of each NetworkPolicy whose spec was changed since its creation.
        sources: the objects of `references(job)`; None: there is no such object. For a Secret the metadata is
            enough.
        kueue: whether the cluster has Kueue.
        verdicts: the known results of the checks of the job's worlds; None: the plan checks them itself.
        worlds_wait: the job's worlds wait for their check, or are being checked; its sources were not
            requested.
    """

    replicas: tuple[ReplicaObserved, ...]
    present: frozenset[tuple[str, str]] = frozenset()
    edited: tuple[tuple[str, int], ...] = ()
    sources: Mapping[ReferencedObject, Raw | None] = field(default_factory=dict)
    kueue: bool = False
    verdicts: Verdicts | None = None
    worlds_wait: bool = False
