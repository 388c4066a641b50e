"""What `decide` returns: a status, and what is to be done; nothing here does anything."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.api.status import Status
from palaestra.decide.times import Record
from palaestra.observe.jobs import REPLACED, STOPPED, SUSPENDED
from palaestra.observe.views import Suspended
from palaestra.plan.job import suspend_set


@dataclass(frozen=True, slots=True, kw_only=True)
class Basis:
    """What a change of a Job was decided on; one that is different by now is looked at anew.

    Attributes:
        uid, version: of the Job.
        pods: uid and resourceVersion of each pod of the replica.
    """

    uid: str = ""
    version: str = ""
    pods: frozenset[tuple[str, str]] = frozenset()


@dataclass(frozen=True, slots=True, kw_only=True)
class Create:
    """Create `object` in its namespace; it has no `replica` when it belongs to the whole job.

    AlreadyExists is no error for a ConfigMap, claim or NetworkPolicy: their names say what they are. A
    Job that exists belongs among `Objects.jobs`, whoever owns it; `observe` tells whose it is.
    """

    object: Mapping[str, Any]
    replica: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """Stop a replica for good: one patch of its Job, which survives whoever wrote it."""

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
    """Replace the pod of a replica: first the patch of its Job, then an eviction of the pod with this uid.

    In this order it can be done again after either: a mark at a pod that lives is an eviction to be done.

    Attributes:
        times: pods of the replica that were replaced so, this one among them.
        marked: the Job carries the mark already.
    """

    job: str
    replica: int
    pod: str
    uid: str
    times: int
    reason: Reason
    message: str
    marked: bool = False
    basis: Basis = field(default=Basis(), compare=False)

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        mark = f"{self.times} {self.uid} {self.reason}: {self.message}"
        return {"metadata": {"annotations": {REPLACED: mark}}}


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSuspend:
    """Suspend or resume the Job of a replica. Never given for a job with a queue: Kueue owns that.

    Attributes:
        mark: of the pod that the suspension ends, or ended; None: the Job's mark stays as it is.
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
    """Delete the suspended Job of a replica that has ended, before a queue admits it and takes others' place.

    Only once the Job is marked as stopped and the status calls the replica ended, so that the operator that
    follows one killed in between reads both.
    """

    job: str
    replica: int
    basis: Basis = field(default=Basis(), compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Delete:
    """Delete the TrainingJob with this `uid`, in the background: it has ended `after_s` seconds ago."""

    name: str
    uid: str
    after_s: int = 0


Change = Stop | Replace | SetSuspend | Discard  # of a Job
Action = Create | Change | Delete


class HappeningType(StrEnum):
    """The type of an event."""

    NORMAL = "Normal"
    WARNING = "Warning"


@dataclass(frozen=True, slots=True, kw_only=True)
class Happening:
    """An event about the TrainingJob, to be written after the status was.

    With `once` it says how things are, at each look, and is written for the first only.
    """

    type: HappeningType
    reason: Reason
    message: str
    replica: int | None = None
    once: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What follows from what was seen.

    Attributes:
        status: the whole status; `write_in_s` says when to write it. None: leave it alone.
        actions: in the order in which they are to be done.
        events: to be written once the status is.
        wake_after_s: seconds until time alone may change something; None: nothing will.
        record: for the next look of this process.
    """

    status: Status | None
    actions: tuple[Action, ...] = ()
    events: tuple[Happening, ...] = ()
    wake_after_s: float | None = None
    record: Record = field(default_factory=Record)
