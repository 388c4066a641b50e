"""The input and the result of a check on one replica."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime

from palaestra.api import SimulatorGroup, TrainingJob
from palaestra.api.reasons import Reason
from palaestra.api.status import Phase, ReplicaStatus
from palaestra.decide.clocks import Times, Wait
from palaestra.decide.explanation import Explanation, Hold, explain
from palaestra.decide.restart_counts import Counted
from palaestra.observe.models import ContainerView, PodView, ReplicaObserved
from palaestra.plan.replica import SIMULATOR_PREFIX

RESUMES = "the next pod resumes from the last checkpoint"
BEGINS = "the next pod starts the run again, because no checkpoint was reported"
FRESH_S = 45  # seconds; an older response does not describe the current state
STARTING = "starting"  # the trainer's phase until all of its simulators run


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaContext:
    """One replica that has not ended.

    Attributes:
        old: the replica's stored status.
        seen: the observation of the replica.
        counted: the attempts and restarts of the replica, including this observation.
        times: the clocks; the wall clock is in UTC and whole seconds.
        active_left_s: remaining seconds of the job's active time; None: the job has no active deadline, or is
            not active now.
        hold: the cause that keeps the replica's objects from being created, or None.
        shown: the reason in the status if the replica continues; set only for the checks of `STOPS`.
        causes: the causes to replace the pod, including causes that will hold later; set only for the checks
            of `STOPS`.
    """

    job: TrainingJob
    old: ReplicaStatus
    seen: ReplicaObserved
    counted: Counted
    times: Times
    active_left_s: float | None = None
    hold: Hold | None = None
    shown: Explanation | None = None
    causes: tuple["Finding", ...] = ()

    @property
    def now(self) -> datetime:
        """Return the wall clock in whole seconds, for the times in a status."""
        return self.times.now

    @property
    def pod(self) -> PodView | None:
        """Return the newest pod, or None if it has ended."""
        pod = self.seen.pod
        return pod if pod is not None and not pod.ended else None

    def waited_s(self, wait: Wait) -> float:
        """Return the seconds since a wait began."""
        return self.times.clock_s - self.times.since_s(self.seen.index, wait)

    def left_s(self, wait: Wait) -> float:
        """Return the remaining seconds of a wait; 0 or less: the wait is over."""
        return wait.seconds - self.waited_s(wait)

    def start_deadline_s(self, container: str) -> int:
        """Return the start deadline of a simulator in seconds; for other containers, the longest deadline."""
        deadlines = {_container(group, i): group.start_deadline_seconds for group, i in _members(self.job)}
        return deadlines.get(container, max(deadlines.values()))

    @property
    def fresh(self) -> bool:
        """Return whether the trainer's last response is at most `FRESH_S` old."""
        polled = self.seen.polled
        return polled is not None and self.times.clock_s - polled.at_s <= FRESH_S

    @property
    def suspended(self) -> bool:
        """Return whether `spec.suspend` or a queue keeps the replica from running."""
        job = self.seen.job
        return self.job.spec.suspend if job is None else job.suspended

    @property
    def trains(self) -> bool:
        """Return whether the trainer has reported that its simulators are up."""
        polled = self.seen.polled
        return polled is not None and polled.status.phase != STARTING


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """The result of a check.

    Attributes:
        explanation: the reason and its message.
        left_s: seconds until the finding holds; 0 or less: the finding holds now.
        wait: the wait that the next reconcile continues, or None.
        phase: the phase of the replica; None: the state of the trainer's container determines the phase.
    """

    explanation: Explanation
    left_s: float = 0.0
    wait: Wait | None = None
    phase: Phase | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplicaVerdict:
    """The phase of a replica or job with its reason."""

    phase: Phase
    explanation: Explanation


Check = Callable[[ReplicaContext], Finding | None]


def found(reason: Reason, **facts: object) -> Finding:
    """Return a finding that holds at once."""
    return Finding(explanation=explain(reason, **facts))


def after(situation: ReplicaContext, wait: Wait, why: Explanation) -> Finding:
    """Return a finding that holds as soon as a wait is over."""
    return Finding(explanation=why, left_s=situation.left_s(wait), wait=wait)


def first_waiting(pod: PodView | None, reasons: frozenset[str]) -> ContainerView | None:
    """Return the first container that waits for one of these reasons of the kubelet."""
    containers = pod.containers if pod is not None else ()
    return next((container for container in containers if container.waiting in reasons), None)


def _members(job: TrainingJob) -> list[tuple[SimulatorGroup, int]]:
    return [(group, i) for group in job.spec.simulators for i in range(group.count)]


def _container(group: SimulatorGroup, index: int) -> str:
    return f"{SIMULATOR_PREFIX}{group.name}-{index}"


def next_pod(situation: ReplicaContext) -> str:
    """Return the text about a replica's next pod, which resumes only from a reported checkpoint.

    A custom program (`spec.trainer.command`) need not report its checkpoints, so its reported step counts as
    a checkpoint.
    """
    return RESUMES if has_checkpoint(situation) else BEGINS


def has_checkpoint(situation: ReplicaContext) -> bool:
    """Return whether an attempt of the replica has reported a checkpoint."""
    seen = situation.seen
    polled = seen.polled.status.last_checkpoint if seen.polled is not None else None
    words = (word.last_checkpoint for word in seen.terminations.values())
    own = situation.job.spec.trainer.command and situation.counted.furthest_step
    return bool(situation.old.last_checkpoint or polled or any(words) or own)
