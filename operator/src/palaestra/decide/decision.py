"""What `decide` returns: a status, and what is to be done; nothing here does anything."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from palaestra.api.reasons import Reason
from palaestra.api.status import Status
from palaestra.observe.jobs import STOPPED


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

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        return {
            "metadata": {"annotations": {STOPPED: f"{self.reason}: {self.message}"}},
            "spec": {"activeDeadlineSeconds": 1},
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class SetSuspend:
    """Suspend or resume the Job of a replica. Never given for a job with a queue: Kueue owns that."""

    job: str
    replica: int
    suspend: bool

    @property
    def patch(self) -> dict[str, Any]:
        """Return the merge patch of the Job."""
        return {"spec": {"suspend": self.suspend}}


@dataclass(frozen=True, slots=True, kw_only=True)
class Delete:
    """Delete the TrainingJob with this `uid`, in the background: it has ended `after_s` seconds ago."""

    name: str
    uid: str
    after_s: int = 0


Action = Create | Stop | SetSuspend | Delete


class HappeningType(StrEnum):
    """The type of an event."""

    NORMAL = "Normal"
    WARNING = "Warning"


@dataclass(frozen=True, slots=True, kw_only=True)
class Happening:
    """An event about the TrainingJob, to be written after the status was."""

    type: HappeningType
    reason: Reason
    message: str
    replica: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Decision:
    """What follows from what was seen.

    Attributes:
        status: the whole status; `worth_writing` says whether to write it now. None: leave it alone.
        actions: in the order in which they are to be done.
        events: to be written once the status is.
        wake_after_s: seconds until time alone may change something; None: nothing will.
    """

    status: Status | None
    actions: tuple[Action, ...] = ()
    events: tuple[Happening, ...] = ()
    wake_after_s: float | None = None
