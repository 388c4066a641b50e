"""The figures of a job since the start of the watch."""

from collections import defaultdict, deque
from dataclasses import dataclass

from palaestra.api import Status
from palaestra.api.status import ReplicaStatus

MOST = 40  # A line shows at most this many values of one figure.


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaFigures:
    """The figures of a replica at one step; an unknown figure is None."""

    step: int
    steps_per_second: float | None
    success_rate: float | None
    mean_return: float | None

    @classmethod
    def of(cls, replica: ReplicaStatus) -> "ReplicaFigures | None":
        """Return the figures of a replica; None before the replica's first step."""
        if replica.step is None:
            return None
        return cls(
            step=replica.step,
            steps_per_second=replica.steps_per_second,
            success_rate=replica.success_rate,
            mean_return=replica.mean_return,
        )


class History:
    """The last figures of each replica of one job."""

    def __init__(self) -> None:
        self._figures: defaultdict[int, deque[ReplicaFigures]] = defaultdict(lambda: deque(maxlen=MOST))

    def add(self, status: Status) -> None:
        """Add the figures of a status; a replica without a change is skipped."""
        for replica in status.replicas:
            figures, known = ReplicaFigures.of(replica), self._figures[replica.index]
            if figures is not None and (not known or known[-1] != figures):
                known.append(figures)

    def of(self, replica: int) -> tuple[ReplicaFigures, ...]:
        """Return the figures of a replica, oldest first."""
        return tuple(self._figures[replica])
