"""The observation of a TrainingJob's objects, as values: the interface between `observe` and `decide`.

`palaestra.observe.json_access` has checked all values: sizes are limited, times are valid, and a pod's report
is absent unless it is valid in the protocol.
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

SIDECARS = (SIMULATOR_PREFIX, ROS_MASTER)  # the names of the planned sidecars begin with these texts

Raw = Mapping[str, Any]  # an object as untrusted JSON


class ReferenceKind(StrEnum):
    """The kinds of objects to which a job may refer."""

    CONFIG_MAP = "ConfigMap"
    SECRET = "Secret"
    CLAIM = "PersistentVolumeClaim"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReferencedObject:
    """An object in the job's namespace to which the job's spec refers.

    `field` is the first field of the spec that refers to the object.

    Two references are equal if they name the same object.
    """

    kind: ReferenceKind
    name: str
    field: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Polled:
    """A trainer's response, and the time of the response on this process's monotonic clock."""

    status: TrainerStatus
    at_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Objects:
    """All objects that the operator has read for one TrainingJob, as raw JSON.

    Attributes:
        jobs, pods, claims, config_maps, policies: objects in the TrainingJob's namespace whose label
            palaestra.dev/job has the TrainingJob's name. `jobs` also has Jobs of other owners with a name
            that the TrainingJob needs.
        events: FailedCreate events about those Jobs, warnings about pods that wait for volumes, and events
            about trainers that the kubelet ended.
        unadmitted: Kueue's reason not to admit a Job, by the Job's uid; a Job is absent if the reason was not
            requested.
        unasked: uids of incomplete Jobs and pods about which the operator sends no request, because too many
            Jobs and pods are incomplete.
        polled: the last responses of trainers by pod UID; absent if the last request to the pod failed.
        denied: the API server's message of the last refused creation, by replica; the key None stands for
            objects of the whole job. A replica without a refusal is absent.
        switchers: the field manager that set `spec.suspend` of a Job, by the Job's uid; absent if the
            operator set the value.
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
    """The end of a container; `message` is its termination message, as the pod wrote it."""

    code: int
    reason: str = ""
    message: str = ""
    at: datetime | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerView:
    """One container of a pod.

    Attributes:
        running_since: the start of the container's current run; None if the container does not run.
        started: whether the startup probe has passed; without a probe, whether the container runs.
        waiting, waiting_message: the kubelet's reason and message, if the container waits; else "".
        exit: the end of the container, if it has ended; for a restarted sidecar, its last end.
        restarts: the number of restarts by the kubelet.
        memory_limit: the memory limit in the container's spec; "" without a limit.
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
        """Return whether the container's name is that of the ROS master or of a simulator's sidecar."""
        return self.name.startswith(SIDECARS)

    @property
    def ended_run(self) -> int:
        """Return the number, from 0, of the container's run that `exit` ended."""
        return self.restarts if self.running_since is None else max(self.restarts - 1, 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PodView:
    """One pod of a replica.

    Attributes:
        version: the pod's resourceVersion.
        started: the time at which a kubelet accepted the pod; None if no kubelet has accepted it.
        phase: Pending, Running, Succeeded, Failed or Unknown.
        reason, message: the pod's own reason and message, for example after an eviction; usually "".
        ready: whether the kubelet reports the pod as ready; False if unknown.
        mounted: whether the pod's volumes are mounted, so that the node pulls images or has pulled them.
        unschedulable: the scheduler's message; "" if the pod was scheduled.
        disruption: the cluster's reason to interrupt the pod (condition DisruptionTarget); "" without a
            disruption.
        gone_by: the end of the grace period after a deletion; None if nobody has deleted the pod. The time is
            from the API server's clock, so it is not compared with the operator's clocks.
        grace_s: seconds between the deletion and `gone_by`.
        containers: the containers in the order of their start.
        claims: names of the PersistentVolumeClaims that the pod mounts.
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
        """Return whether all containers of the pod have ended for good."""
        return self.phase in {"Succeeded", "Failed"}

    @property
    def trainer(self) -> ContainerView | None:
        """Return the trainer's container; None if the pod does not have it.

        A service mesh or an agent may add containers to a pod, even before the trainer.
        """
        return next((container for container in self._main if container.name == TRAINER), None)

    @property
    def keeping(self) -> tuple[str, ...]:
        """Return the foreign containers that keep the pod from ending with its trainer."""
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
        """Return the native sidecars: the ROS master, the simulators' sidecars, and foreign sidecars."""
        return tuple(container for container in self.containers if container.kind is ContainerKind.SIDECAR)


class JobEnd(StrEnum):
    """The end of a batch/v1 Job."""

    COMPLETE = "Complete"
    FAILED = "Failed"


@dataclass(frozen=True, slots=True, kw_only=True)
class Replaced:
    """The mark on a Job whose pod the operator replaces.

    Attributes:
        times: number of pods that the operator has replaced, including the last one.
        pod: uid of the pod that was replaced last.
        reason, message: the reason for the last replacement, and its message.
    """

    times: int
    pod: str
    reason: str
    message: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Suspended:
    """The mark on a Job that the operator has suspended.

    Attributes:
        pod: uid of the pod that the current attempt had at the suspension.
        lived: whether the suspension ended the pod; False if the pod had ended or was being deleted before.
    """

    pod: str
    lived: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class JobView:
    """The batch/v1 Job of a replica.

    Attributes:
        version: the resourceVersion of the Job.
        suspended: the current value of `spec.suspend`.
        suspend_set: the value of `spec.suspend` that the operator set last, from its annotation; None: the
            Job has no annotation, for example because the operator created the Job for a queue.
        suspension: the operator's mark about the pod that the Job's last suspension ended, or None.
        paused: the time of the suspension by the Job controller's clock; None: the Job is not suspended.
        resumed: the time of the last resumption by the Job controller's clock; None: the Job was never
            suspended, or is suspended now.
        stopped: reason and message of the operator's stop mark, or None.
        replaced: the operator's mark about the pods that it replaced, or None.
        failures: number of pods that failed and count against backoffLimit.
        end, end_reason, end_message: the end in the Job's conditions; None and "" until the Job ends.
        settings: fields of the Job's spec that other clients may change; a missing field is absent.
        deleting: whether the Job is being deleted.
        volumes: names of the ConfigMaps and claims that the Job's pods mount.
        queue: the name of the Job's Kueue queue, from the spec or the namespace's default; "": no queue.
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
    """A Job of another owner with a name that a TrainingJob needs; `deleting`: the Job is being deleted."""

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
        pods: the pods of the replica's Job, and the pod that the status names; oldest first.
        in_the_way: names of all other unfinished pods with the replica's labels. The operator ignores their
            reports, but they may write to the replica's volume.
        former: unfinished pods of an earlier TrainingJob of the same name that mount the `existingClaim` of
            this replica.
        polled: the response of the newest pod's trainer; None: unknown.
        terminations: valid termination messages of trainers, by pod UID.
        refused: the last refusal of a pod, if it is newer than the newest pod.
        denied: the reason for which an object of the replica could not be created, or "".
        unmounted: the cluster's message about unmounted volumes of the newest pod; "": all volumes are
            mounted, or no event has a reason.
        probe: the failed probe, "liveness" or "startup", for which the kubelet ended the newest pod's
            trainer; "": no probe failed, or no event reports it.
        unadmitted: Kueue's reason not to admit the Job; "": Kueue has admitted the Job, or reports no reason;
            None: the reason was not requested yet.
        unasked: whether the pod, its volumes or Kueue's admission are missing, and the operator sends no
            request about the cause.
        switcher: the field manager that set the Job's `spec.suspend`; "": the operator set it, or the manager
            is unknown.
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
        """Return the newest pod, or None."""
        return self.pods[-1] if self.pods else None

    @property
    def termination(self) -> Termination | None:
        """Return the termination message of the newest pod's trainer."""
        return self.terminations.get(self.pod.uid) if self.pod else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Observed:
    """The observation of a TrainingJob.

    The operator adds `sources`, `kueue`, `verdicts` and `worlds_wait`. The operator needs these values only
    while objects of the job are missing.

    Attributes:
        replicas: the observations of the spec's replicas, by index.
        present: kind and name of the existing ConfigMaps, claims and NetworkPolicies.
        edited: name and generation of each NetworkPolicy whose spec was changed since its creation.
        sources: the objects of `references(job)`; None: the object does not exist. Of a Secret, only the
            metadata is needed.
        kueue: whether the cluster has Kueue.
        verdicts: the known results of the checks of the job's worlds; None: the plan checks the worlds
            itself.
        worlds_wait: whether the job's worlds wait for a check or are under check; then the sources were not
            requested.
    """

    replicas: tuple[ReplicaObserved, ...]
    present: frozenset[tuple[str, str]] = frozenset()
    edited: tuple[tuple[str, int], ...] = ()
    sources: Mapping[ReferencedObject, Raw | None] = field(default_factory=dict)
    kueue: bool = False
    verdicts: Verdicts | None = None
    worlds_wait: bool = False
