"""What a check about one replica looks at, and what it may say."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from palaestra.api import SimulatorGroup, TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.api.status import Phase, ReplicaStatus
from palaestra.decide.conditions import Told
from palaestra.decide.counting import Counted
from palaestra.decide.preparing import Hold
from palaestra.decide.times import Times, Wait
from palaestra.observe.views import ContainerView, PodView, ReplicaObserved


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """One replica that has not ended.

    Attributes:
        old: what the status said of it.
        seen: what the cluster shows.
        counted: its attempts and restarts by now.
        times: the clocks; the wall's in UTC and whole seconds.
        active_left_s: seconds of the job's active time that are left; None: it has no bound, or its time
            does not pass now.
        hold: what keeps its objects from being made; None: nothing does.
    """

    job: TrainingJob
    old: ReplicaStatus
    seen: ReplicaObserved
    counted: Counted
    times: Times
    active_left_s: float | None = None
    hold: Hold | None = None

    @property
    def now(self) -> datetime:
        """Return the wall clock, in whole seconds, to stamp a status with."""
        return self.times.now

    @property
    def pod(self) -> PodView | None:
        """Return the newest pod while it has not ended."""
        pod = self.seen.pod
        return pod if pod is not None and not pod.ended else None

    def waited_s(self, wait: Wait) -> float:
        """Return how long a wait has gone on."""
        return self.times.clock_s - self.times.since_s(self.seen.index, wait)

    def left_s(self, wait: Wait) -> float:
        """Return how much longer a wait may go on; 0 or less: it is over."""
        return wait.seconds - self.waited_s(wait)

    def start_deadline_s(self, container: str) -> int:
        """Return how long a container may take to come up, the trainer and the master the longest."""
        deadlines = {_container(group, i): group.start_deadline_seconds for group, i in _members(self.job)}
        return deadlines.get(container, max(deadlines.values()))

    @property
    def fresh(self) -> bool:
        """Return whether the trainer has answered lately."""
        polled = self.seen.polled
        return polled is not None and self.times.clock_s - polled.at_s <= FRESH_S

    @property
    def suspended(self) -> bool:
        """Return whether the replica is kept from running by `spec.suspend` or by a queue."""
        job = self.seen.job
        return self.job.spec.suspend if job is None else job.suspended

    @property
    def trains(self) -> bool:
        """Return whether the trainer is known to be past the start of its simulators."""
        polled = self.seen.polled
        return polled is not None and polled.status.phase != STARTING


FRESH_S = 45  # an older answer is no word of what is now
STARTING = "starting"  # the trainer's phase until all its simulators are up


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What a check has found.

    Attributes:
        told: the reason and its message.
        left_s: seconds until it holds; 0 or less: it does.
        wait: what is to be remembered until the next look; None: nothing is.
        phase: where the replica stands by it; None: as its trainer's container does.
    """

    told: Told
    left_s: float = 0.0
    wait: Wait | None = None
    phase: Phase | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """Where a replica stands, and why."""

    phase: Phase
    told: Told


Check = Callable[[Situation], Finding | None]


def told(reason: Reason, **facts: object) -> Told:
    """Return a reason with its message."""
    return Told(reason=reason, message=say(reason, **facts))


def found(reason: Reason, **facts: object) -> Finding:
    """Return what holds at once."""
    return Finding(told=told(reason, **facts))


def after(it: Situation, wait: Wait, why: Told) -> Finding:
    """Return what holds once a wait is over."""
    return Finding(told=why, left_s=it.left_s(wait), wait=wait)


def first_waiting(pod: PodView | None, reasons: frozenset[str]) -> ContainerView | None:
    """Return the first container that waits for one of these reasons of the kubelet."""
    containers = pod.containers if pod is not None else ()
    return next((each for each in containers if each.waiting in reasons), None)


def _members(job: TrainingJob) -> list[tuple[SimulatorGroup, int]]:
    return [(group, i) for group in job.spec.simulators for i in range(group.count)]


def _container(group: SimulatorGroup, index: int) -> str:
    return f"sim-{group.name}-{index}"
