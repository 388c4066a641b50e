"""The result of `decide` as data: a status, actions and events."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.api.status import Status
from palaestra.decide.clocks import ReconcileRecord
from palaestra.observe.jobs import REPLACED, STOPPED, SUSPENDED
from palaestra.observe.models import Suspended
from palaestra.plan.job import suspend_set


@dataclass(frozen=True, slots=True, kw_only=True)
class Basis:
    """The versions of a Job and its pods at a decision; if they have changed, the action is skipped.

    Attributes:
        uid, version: uid and resourceVersion of the Job.
        pods: uid and resourceVersion of each pod of the replica.
    """

    uid: str = ""
    version: str = ""
    pods: frozenset[tuple[str, str]] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Create:
    """Create `object` in its namespace; `replica` is None if the object belongs to the whole job.

    AlreadyExists is not an error for a ConfigMap, claim or NetworkPolicy, because their names determine their
    content. An existing Job is added to `Objects.jobs`, even if another object owns it; `observe` checks the
    owner.
    """

    object: Mapping[str, Any]
    replica: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Stop a replica for good by one patch of its Job; the replica stays stopped if the operator restarts."""

    job: str
    replica: int
    reason: Reason
    message: str
    basis: Basis = field(default=Basis(), compare=False)

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        return {
            "metadata": {"annotations": {STOPPED: f"{self.reason}: {self.message}"}},
            "spec": {"activeDeadlineSeconds": 1},
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Replace:
    """Replace the pod of a replica: first patch its Job, then evict the pod with this uid.

    In this order both steps can be repeated: if the annotated pod still runs, the operator evicts it again.

    Attributes:
        times: number of pods of the replica that the operator has replaced, including this pod.
        marked: whether the Job already has the annotation about this pod.
        ended: whether the pod has ended, so that only the annotation is needed.
    """

    job: str
    replica: int
    pod: str
    uid: str
    times: int
    reason: Reason
    message: str
    marked: bool = False
    ended: bool = False
    basis: Basis = field(default=Basis(), compare=False)

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        mark = f"{self.times} {self.uid} {self.reason}: {self.message}"
        return {"metadata": {"annotations": {REPLACED: mark}}}


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSuspend:
    """Suspend or resume the Job of a replica; only Kueue does this for a job with a queue.

    Attributes:
        mark: the pod that the suspension ends or ended; None leaves the Job's annotation unchanged.
    """

    job: str
    replica: int
    suspend: bool
    mark: Suspended | None = None
    basis: Basis = field(default=Basis(), compare=False)

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        annotations = suspend_set(suspend=self.suspend)
        if self.mark is not None:
            annotations[SUSPENDED] = f"{self.mark.pod} {'lived' if self.mark.lived else 'ended'}"
        return {"metadata": {"annotations": annotations}, "spec": {"suspend": self.suspend}}


@dataclass(frozen=True, slots=True, kw_only=True)
class Discard:
    """Delete the suspended Job of an ended replica; otherwise Kueue could admit it and preempt other Jobs.

    Before the deletion, the Job is annotated as stopped and the status reports that the replica has ended. So
    an operator that restarts in between finds both facts.
    """

    job: str
    replica: int
    basis: Basis = field(default=Basis(), compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Delete:
    """Delete the TrainingJob with this `uid` (background propagation); it ended `after_s` seconds ago."""

    name: str
    uid: str
    after_s: int = 0


Change = Stop | Replace | SetSuspend | Discard  # the actions that change or delete a Job
Action = Create | Change | Delete


class EventType(StrEnum):
    """The type of an event."""

    NORMAL = "Normal"
    WARNING = "Warning"


@dataclass(frozen=True, slots=True, kw_only=True)
class EmittedEvent:
    """An event about the TrainingJob, to be written after the status.

    With `once`, the event describes a state: each reconcile yields it, and only the first is written.
    """

    type: EventType
    reason: Reason
    message: str
    replica: int | None = None
    once: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """The decision on one observation.

    Attributes:
        status: the whole status; `write_in_s` returns the time of the write. None leaves the status
            unchanged.
        actions: the actions in the order of their execution.
        events: the events to write after the status.
        wake_after_s: seconds until the decision may change by time alone; None: never.
        record: the record for the next reconcile in this process.
    """

    status: Status | None
    actions: tuple[Action, ...] = ()
    events: tuple[EmittedEvent, ...] = ()
    wake_after_s: float | None = None
    record: ReconcileRecord = field(default_factory=ReconcileRecord)
