"""Exact counts of a replica's attempts and restarts, derived from the current state and not from events.

The earlier counts are in the status, which also names the pod of the current attempt (`pod`). Every pod that
was created after this pod is a new attempt. Trainers record their attempts in the run directory, and report
the number in /status and in the termination message. So this module also counts attempts whose pods the
operator never observed.

Each replaced pod is counted under one of four causes. The attempt's number is 1 plus the sum of these counts:

- trainer: the pod failed by itself, according to its own status or the Job's count of failures.
- operator: the operator replaced the pod, according to the mark on its Job.
- suspension: the operator suspended the Job while the pod ran, according to the mark on the Job. If another
  controller suspended the Job, the status between the two pods or the times of the Job show the suspension.
- disruption: all other causes. The cluster or a person deleted the pod, or the trainer exited with 75.

A failed pod counts as a restart only when its successor exists. The trainer counts the restarts of simulators
within its attempt. The status stores this count (`simulatorRestarts`) next to the sum over all attempts, so
that only the difference is added to the sum. One write of the status updates all counts, and the write fails
if the job has changed since the operator read it. So no restart is counted twice.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import timedelta

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase, PodReference, ReplicaStatus, Restarts
from palaestra.observe.json_access import MOST_COUNT
from palaestra.observe.models import JobView, PodView, ReplicaObserved
from palaestra_protocol.pod.status import ExitCode

# A pod can report any number of attempts, so a report is ignored if it exceeds the number of observed
# attempts by more than this limit.
MOST_UNSEEN = 100

# The Job controller creates the pod first and records the time of the resumption later. Both times are whole
# seconds.
_RESUMED_LATE = timedelta(seconds=2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """The counts of a replica; `ReplicaStatus` has a field of the same name for each count."""

    attempt: int
    pod: PodReference | None
    restarts: Restarts
    simulator_restarts: int
    furthest_step: int | None
    fruitless: int


def counted(old: ReplicaStatus, seen: ReplicaObserved) -> Counted:
    """Return the counts after the observation `seen`; `old` is the stored status."""
    newer = newer_pods(old, seen.pods)
    attempt = _attempt(old, seen, newer)
    restarts = _restarts(old, seen, newer, attempt)
    furthest = _furthest(old, seen)
    progressed = furthest is not None and furthest > (old.furthest_step or 0)
    fruitless = min(restarts.disruption - old.restarts.disruption, _have_run(old, seen, newer))
    within = _within_attempt(old, seen, newer)
    return Counted(
        attempt=attempt,
        pod=_reference(newer[-1]) if newer else old.pod,
        restarts=restarts.model_copy(update={"simulator": _simulators(old, seen, newer, within)}),
        simulator_restarts=within,
        furthest_step=furthest,
        fruitless=0 if progressed or not furthest else _bounded(old.fruitless + fruitless),
    )


def newer_pods(old: ReplicaStatus, pods: Sequence[PodView]) -> tuple[PodView, ...]:
    """Return the pods that were created after the pod in the status, oldest first.

    Times are whole seconds. If the pod in the status no longer exists, a pod created in the same second
    counts as newer. Such a pod cannot be older: after the failure of an older pod, the Job controller would
    have waited several seconds before it created the pod in the status.
    """
    named = old.pod
    if named is None:
        return tuple(pods)
    uids = [pod.uid for pod in pods]
    if named.uid in uids:
        return tuple(pods[uids.index(named.uid) + 1 :])
    return tuple(pod for pod in pods if pod.created >= named.created)


def of_this_run(old: ReplicaStatus, pods: Sequence[PodView]) -> frozenset[str]:
    """Return the uids of the pods whose reports count.

    After a lost run was restarted, only the reports of pods that were created later count.
    """
    if old.lost is not None and old.lost.restarted is not None and old.lost.pod is not None:
        pods = newer_pods(old.model_copy(update={"pod": old.lost.pod}), pods)
        return frozenset(pod.uid for pod in pods if pod.uid != old.lost.pod.uid)
    return frozenset(pod.uid for pod in pods)


def failed_by_itself(pod: PodView) -> bool:
    """Return whether the end of a pod counts against `backoffLimit`, by the rules of podFailurePolicy."""
    interrupted = pod.trainer is not None and exit_code(pod) == ExitCode.INTERRUPTED
    return pod.phase == "Failed" and not pod.disruption and not interrupted


def has_run(pod: PodView) -> bool:
    """Return whether a pod's trainer runs or has run."""
    trainer = pod.trainer
    return trainer is not None and (trainer.running_since is not None or trainer.exit is not None)


def lives(pod: PodView) -> bool:
    """Return whether a pod's trainer may still run and the pod is not being deleted."""
    return not pod.ended and pod.gone_by is None and exit_code(pod) is None


def exit_code(pod: PodView) -> int | None:
    """Return the exit code of a pod's trainer; None if the trainer has not ended, or its code is unknown."""
    trainer = pod.trainer
    ended = trainer is not None and trainer.running_since is None and trainer.exit is not None
    return trainer.exit.code if ended and trainer and trainer.exit else None


def _attempt(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView]) -> int:
    by_pods = old.attempt + len(newer)
    polled = seen.polled.status.attempt if seen.polled else None
    ended = seen.termination.attempt if seen.termination else None
    recorded = max(polled or 0, ended or 0)
    return _bounded(max(by_pods, recorded if recorded <= by_pods + MOST_UNSEEN else 0))


def _restarts(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView], attempt: int) -> Restarts:
    before = old.restarts
    explained = before.trainer + before.disruption + before.suspension + before.operator
    replaced = max(attempt - 1 - explained, 0)
    trainer = min(max(_by_evidence(old, seen, newer), _by_the_job(old, seen)), replaced)
    operator = min(_by_the_operator(old, seen), replaced - trainer)
    suspension = min(_suspended(old, seen, newer), replaced - trainer - operator)
    return before.model_copy(
        update={
            "trainer": before.trainer + trainer,
            "operator": before.operator + operator,
            "suspension": before.suspension + suspension,
            "disruption": before.disruption + replaced - trainer - operator - suspension,
        }
    )


def _by_evidence(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView]) -> int:
    """Return the number of pods that were replaced since the last status and failed by themselves."""
    named = [pod for pod in seen.pods if old.pod is not None and pod.uid == old.pod.uid]
    chain = [*named, *newer]
    return sum(failed_by_itself(pod) for pod in chain[:-1])


def _have_run(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView]) -> int:
    """Return the number of pods that were replaced since the last status and ran a trainer."""
    named = [pod for pod in seen.pods if old.pod is not None and pod.uid == old.pod.uid]
    chain = [*named, *newer]
    gone = old.pod is not None and not named and old.phase is Phase.RUNNING
    return int(gone) + sum(has_run(pod) for pod in chain[:-1])


def _by_the_job(old: ReplicaStatus, seen: ReplicaObserved) -> int:
    """Return the number of older pods whose failure is in the Job's count but not in the status yet."""
    if seen.job is None:
        return 0
    last = seen.pod is not None and failed_by_itself(seen.pod)
    return max(seen.job.failures - last - old.restarts.trainer, 0)


def _by_the_operator(old: ReplicaStatus, seen: ReplicaObserved) -> int:
    """Return the number of older pods that the operator replaced and that the status does not count yet."""
    mark = seen.job.replaced if seen.job is not None else None
    if mark is None:
        return 0
    last = seen.pod is not None and seen.pod.uid == mark.pod
    return max(mark.times - last - old.restarts.operator, 0)


def _suspended(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView]) -> int:
    """Return 1 if a suspension ended one of the pods replaced since the last status."""
    if not newer or seen.job is None:
        return 0
    replaced = {old.pod.uid if old.pod is not None else "", *(pod.uid for pod in newer[:-1])}
    mark = seen.job.suspension
    if mark is not None and mark.pod in replaced:
        return int(mark.lived)
    if old.phase is Phase.SUSPENDED or old.reason == Reason.SUSPENDING:
        return int(not _ended_otherwise(old))
    return _suspended_by_times(old, seen.job, newer)


def _ended_otherwise(old: ReplicaStatus) -> bool:
    """Return whether the current pod of a suspended replica had already ended for another reason."""
    last = old.last_attempt
    if last is None or last.attempt != old.attempt:
        return False
    return last.reason not in {Reason.SUSPENDED, Reason.QUEUED}


def _suspended_by_times(old: ReplicaStatus, job: JobView, newer: Sequence[PodView]) -> int:
    """Return 1 if the Job was suspended after the pod in the status, and resumed before the newest pod."""
    if old.pod is None:
        return 0
    named, newest = old.pod.created, newer[-1].created
    # The operator has observed the new pod, but not the Job's resumption yet.
    if (paused := job.paused) is not None:
        return int(named <= paused < newest)
    resumed = job.resumed
    return int(resumed is not None and named + _RESUMED_LATE < resumed <= newest + _RESUMED_LATE)


def _within_attempt(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView]) -> int:
    """Return the restarts of simulators within the current attempt."""
    before = 0 if newer else old.simulator_restarts
    polled = sum(simulator.restarts for simulator in seen.polled.status.simulators) if seen.polled else 0
    ended = (seen.termination.restarts or 0) if seen.termination else 0
    return _bounded(max(before, polled, ended))


def _simulators(old: ReplicaStatus, seen: ReplicaObserved, newer: Sequence[PodView], within: int) -> int:
    """Return the restarts of simulators over all attempts."""
    if not newer:
        return _bounded(old.restarts.simulator + within - old.simulator_restarts)
    messages = seen.terminations
    named = messages.get(old.pod.uid) if old.pod else None
    late = max((named.restarts or 0) - old.simulator_restarts, 0) if named else 0
    between = sum(messages[pod.uid].restarts or 0 for pod in newer[:-1] if pod.uid in messages)
    return _bounded(old.restarts.simulator + late + between + within)


def _furthest(old: ReplicaStatus, seen: ReplicaObserved) -> int | None:
    steps = [old.furthest_step, old.step, *_steps(old, seen)]
    return max((_bounded(step) for step in steps if step is not None), default=None)


def _steps(old: ReplicaStatus, seen: ReplicaObserved) -> Iterable[int]:
    current = of_this_run(old, seen.pods)
    for pod, message in seen.terminations.items():
        if pod in current:
            yield message.step
    if seen.polled and seen.pod and seen.pod.uid in current:
        yield seen.polled.status.step


def _reference(pod: PodView) -> PodReference:
    return PodReference(name=pod.name or "unknown", uid=pod.uid or "unknown", created=pod.created)


def _bounded(number: int) -> int:
    return min(max(number, 0), MOST_COUNT)
