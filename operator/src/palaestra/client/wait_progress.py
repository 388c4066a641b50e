"""Convert the progress in a job's status to lines of text, and find the reason for its phase."""

import re
from collections.abc import Iterator

from palaestra.api import TrainingJob
from palaestra.api.reason_texts import ROWS
from palaestra.api.reasons import Reason
from palaestra.api.status import TERMINAL, ConditionStatus, ReplicaStatus, Status

_NUMBERS = re.compile(r"\d+")


class News:
    """Reports each phase of a job, and each waiting reason of a replica, once.

    The kubelet alternates between two messages, and its messages contain the number of retries. So a message
    is reported a second time only after the reason has changed, and numbers in messages are not compared.
    """

    def __init__(self, name: str) -> None:
        """Begin; each line will start with `name`."""
        self._name = name
        self._phase = ""
        self._reported: set[tuple[object, ...]] = set()

    def of(self, phase: str, status: Status) -> Iterator[str]:
        """Yield a line for a new phase, then a line for each replica with a new waiting reason."""
        if phase != self._phase:
            self._phase = phase
            yield f"{self._name}: {phase}"
        for replica in filter(_waits, status.replicas):
            change = (replica.index, replica.reason, replica.since, _NUMBERS.sub("0", replica.message or ""))
            if change not in self._reported:
                self._reported.add(change)
                yield f"{self._name}: {_line(replica)}"


def current(job: TrainingJob) -> bool:
    """Return whether the status is about the newest spec."""
    return job.status.observed_generation == job.metadata.generation


def why(status: Status) -> str:
    """Return reason and message of the condition for the job's phase; "" if no such condition is true."""
    for condition in status.conditions:
        if (
            status.phase
            and condition.type.value == status.phase.value
            and condition.status is ConditionStatus.TRUE
        ):
            return f"{condition.reason}: {condition.message}"
    return ""


def _waits(replica: ReplicaStatus) -> bool:
    """Return whether a replica reports a problem or a queue, and not normal progress."""
    if replica.reason is None or replica.phase in TERMINAL:
        return False
    reason = Reason.known(replica.reason)
    return ROWS[reason].warning or reason is Reason.QUEUED


def _line(replica: ReplicaStatus) -> str:
    since = f" since {replica.since:%Y-%m-%dT%H:%M:%SZ}" if replica.since else ""
    return f"replica {replica.index}: {replica.reason}{since}: {replica.message or ''}".rstrip(": ")
