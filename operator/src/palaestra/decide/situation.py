"""What a check about one replica looks at, and what it may say."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from palaestra.api import SimulatorGroup, TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.api.status import Phase, ReplicaStatus
from palaestra.decide.conditions import Told
from palaestra.decide.counting import Counted
from palaestra.observe.views import ContainerView, PodView, ReplicaObserved


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """One replica that has not ended.

    Attributes:
        old: what the status said of it.
        seen: what the cluster shows.
        counted: its attempts and restarts by now.
        now: in UTC and whole seconds.
        deadline: when the job's active time is over; None: never, or it does not pass now.
    """

    job: TrainingJob
    old: ReplicaStatus
    seen: ReplicaObserved
    counted: Counted
    now: datetime
    deadline: datetime | None = None

    @property
    def pod(self) -> PodView | None:
        """Return the newest pod while it has not ended."""
        pod = self.seen.pod
        return pod if pod is not None and not pod.ended else None

    def since(self, reason: Reason) -> datetime:
        """Return since when the status says `reason`; now, if it does not yet."""
        return self.old.since if self.old.since and self.old.reason == reason else self.now

    def start_deadline_s(self, container: str) -> int:
        """Return how long a container may take to come up, the trainer and the master the longest."""
        deadlines = {_container(group, i): group.start_deadline_seconds for group, i in _members(self.job)}
        return deadlines.get(container, max(deadlines.values()))

    @property
    def trains(self) -> bool:
        """Return whether the trainer is known to be past the start of its simulators."""
        polled = self.seen.polled
        return polled is not None and polled.status.phase != STARTING


STARTING = "starting"  # the trainer's phase until all its simulators are up


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadline:
    """A moment at which a replica is stopped for good, unless something changes before."""

    at: datetime
    told: Told


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Where a replica stands, and why."""

    phase: Phase
    told: Told


TroubleCheck = Callable[[Situation], Told | None]
DeadlineCheck = Callable[[Situation], Deadline | None]


def told(reason: Reason, **facts: object) -> Told:
    """Return a reason with its message."""
    return Told(reason=reason, message=say(reason, **facts))


def first_waiting(pod: PodView | None, reasons: frozenset[str]) -> ContainerView | None:
    """Return the first container that waits for one of these reasons of the kubelet."""
    containers = pod.containers if pod is not None else ()
    return next((each for each in containers if each.waiting in reasons), None)


def _members(job: TrainingJob) -> list[tuple[SimulatorGroup, int]]:
    return [(group, i) for group in job.spec.simulators for i in range(group.count)]


def _container(group: SimulatorGroup, index: int) -> str:
    return f"sim-{group.name}-{index}"
