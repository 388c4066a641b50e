"""The reason for the end of an attempt: the first check that holds for its pod and its last message.

A disruption is checked before the exit code with which the trainer reacts to the disruption. The Job's
podFailurePolicy has the same order.
"""

from collections.abc import Callable
from dataclasses import dataclass

from palaestra.api.reasons import Reason
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.pod_end import (
    full_volume,
    how_it_failed,
    killed_for_memory,
    kills_of,
    limit_of,
    mark_of,
    memory_kills,
    probe_failed,
    storage_eviction,
)
from palaestra.decide.replica_context import ReplicaContext, next_pod
from palaestra.decide.restart_counts import exit_code, failed_by_itself
from palaestra.decide.suspend import ended_by_suspension, suspended_by
from palaestra.observe.models import JobView, PodView
from palaestra.plan.replica import TRAINER
from palaestra_protocol.pod.enums import SILENT
from palaestra_protocol.pod.status import ExitCode, Termination

BY_SIGNAL = frozenset({None, ExitCode.INTERRUPTED, 128 + 9, 128 + 15})  # exit codes that a deletion may cause
GONE = "its pod is gone; it left no termination message"
TAKEN, AGAIN = ", which evicted it", "; it continues when it is admitted again"
_HUNG = "SimulatorHung"  # the first word of a termination message


@dataclass(frozen=True, slots=True, kw_only=True)
class EndedAttempt:
    """An attempt that has ended.

    Attributes:
        situation: the replica of the attempt.
        number: the number of the attempt, from 1.
        name: the name of the attempt's pod.
        pod: the attempt's pod; None if the pod was deleted.
        code: the exit code of the attempt's trainer; None if unknown.
    """

    situation: ReplicaContext
    number: int
    name: str
    pod: PodView | None
    code: int | None

    @property
    def word(self) -> Termination | None:
        """Return the trainer's termination message."""
        return self.situation.seen.terminations.get(self.pod.uid) if self.pod is not None else None

    @property
    def words(self) -> str:
        """Return the most detailed known description of the attempt's end."""
        if self.word is not None:
            return self.word.reason
        return how_it_failed(self.situation, self.pod) if self.pod is not None else GONE


EndCheck = Callable[[EndedAttempt], Explanation | None]


def of_pod(situation: ReplicaContext, pod: PodView, number: int) -> EndedAttempt:
    """Return the attempt of a pod that still exists."""
    return EndedAttempt(situation=situation, number=number, name=pod.name, pod=pod, code=exit_code(pod))


def ended_silently(attempt: EndedAttempt) -> Explanation | None:
    """The built-in loop did not report that the training was complete: a library ended its process."""
    if attempt.code != ExitCode.DONE or attempt.pod is None or attempt.word is not None:
        return None
    own = attempt.situation.job.spec.trainer.command
    return None if own else explain(Reason.TRAINER_FAILED, how=SILENT)


def completed(attempt: EndedAttempt) -> Explanation | None:
    """The training is complete."""
    return explain(Reason.SUCCEEDED, what=success(attempt.word)) if attempt.code == ExitCode.DONE else None


def evicted_for_storage(attempt: EndedAttempt) -> Explanation | None:
    """The pod was evicted because it wrote more data than its limit allows."""
    return None if attempt.pod is None else storage_eviction(attempt.pod)


def replaced(attempt: EndedAttempt) -> Explanation | None:
    """The operator replaced the pod, because the kubelet cannot repair it."""
    return None if attempt.pod is None else mark_of(attempt.situation, attempt.pod)


def disrupted(attempt: EndedAttempt) -> Explanation | None:
    """The cluster disrupted the pod; a condition of the pod has the cause."""
    if attempt.pod is None or not attempt.pod.disruption:
        return None
    return _disrupted(attempt, attempt.pod.disruption)


def gone(attempt: EndedAttempt) -> Explanation | None:
    """The pod was deleted; report the cause under which its restart was counted."""
    if attempt.pod is not None:
        return None
    before, after = attempt.situation.old.restarts, attempt.situation.counted.restarts
    if after.trainer > before.trainer:
        return explain(Reason.TRAINER_FAILED, how=GONE)
    mark = attempt.situation.seen.job.replaced if attempt.situation.seen.job is not None else None
    if mark is not None and after.operator > before.operator:
        return Explanation(reason=Reason.known(mark.reason), message=mark.message or mark.reason)
    if after.suspension > before.suspension:
        return paused(attempt.situation)
    return _disrupted(attempt, GONE)


def deleted(attempt: EndedAttempt) -> Explanation | None:
    """The pod was deleted by the operator, by Kueue or by a person."""
    pod, job = attempt.pod, attempt.situation.seen.job
    if attempt.code not in BY_SIGNAL or pod is None or pod.gone_by is None:
        return None
    if job is not None and (stop := stop_of(job)) is not None:
        return stop
    if job is not None and (job.suspended or ended_by_suspension(attempt.situation.seen, pod)):
        return paused(attempt.situation)
    # The trainer did not save and exit with 75 in time. The Job counts such an end as a failure, so this
    # function does too.
    if attempt.code not in {None, ExitCode.INTERRUPTED} or failed_by_itself(pod):
        how = how_it_failed(attempt.situation, pod)
        how = f"{how}; the pod was deleted, and the trainer did not save in time"
        return explain(Reason.TRAINER_FAILED, how=how)
    return _disrupted(attempt, "it was deleted")


def ended_by_probe(attempt: EndedAttempt) -> Explanation | None:
    """A probe failed and the kubelet ended the trainer; the cluster reports this only for the newest pod."""
    known, newest = attempt.situation.old.last_attempt, attempt.situation.seen.pod
    if attempt.pod is None or attempt.code not in BY_SIGNAL:
        return None
    if newest is not None and newest.uid == attempt.pod.uid and attempt.situation.seen.probe:
        return probe_failed(attempt.situation, attempt.pod)
    kept = known is not None and (known.attempt, known.reason) == (attempt.number, Reason.PROBE_FAILED)
    return Explanation(reason=Reason.PROBE_FAILED, message=known.message) if known and kept else None


def interrupted(attempt: EndedAttempt) -> Explanation | None:
    """The trainer was interrupted for an unknown reason."""
    if attempt.code != ExitCode.INTERRUPTED or attempt.pod is None:
        return None
    how, begins = how_it_failed(attempt.situation, attempt.pod), next_pod(attempt.situation)
    return explain(Reason.INTERRUPTED, pod=attempt.name, how=how, next_pod=begins)


def configuration_refused(attempt: EndedAttempt) -> Explanation | None:
    """The trainer refused its configuration; retrying cannot help."""
    return _of_code(attempt, ExitCode.CONFIGURATION, Reason.CONFIGURATION_REFUSED)


def simulator_budget_spent(attempt: EndedAttempt) -> Explanation | None:
    """The trainer ended because a simulator failed more often than its restart budget allows."""
    if attempt.code != ExitCode.FAULT_BUDGET:
        return None
    return explain(Reason.SIMULATOR_BUDGET_SPENT, words=attempt.words, memory=_memory(attempt))


def diverged(attempt: EndedAttempt) -> Explanation | None:
    """The learner diverged: a loss, weight or reward is NaN or infinite."""
    return _of_code(attempt, ExitCode.DIVERGED, Reason.DIVERGED)


def trainer_out_of_memory(attempt: EndedAttempt) -> Explanation | None:
    """The trainer ran out of memory; a retry would need the same amount."""
    trainer = attempt.pod.trainer if attempt.pod is not None else None
    if trainer is None or not killed_for_memory(trainer):
        return None
    return explain(
        Reason.TRAINER_OUT_OF_MEMORY,
        limit=limit_of(trainer.memory_limit),
        times=kills_of(attempt.situation, TRAINER),
    )


def simulator_hung(attempt: EndedAttempt) -> Explanation | None:
    """The trainer waited for one simulator until its deadline passed."""
    if attempt.code != ExitCode.STALLED or attempt.word is None or not attempt.word.reason.startswith(_HUNG):
        return None
    return explain(Reason.SIMULATOR_HUNG, what=attempt.word.reason)


def stalled(attempt: EndedAttempt) -> Explanation | None:
    """The trainer's watchdog ended the trainer."""
    if attempt.code != ExitCode.STALLED:
        return None
    seconds = attempt.situation.job.spec.stall_deadline_seconds
    what = attempt.word.reason if attempt.word else f"no environment step for {seconds} s"
    return explain(Reason.STALLED, what=what)


def storage_full(attempt: EndedAttempt) -> Explanation | None:
    """The volume is full."""
    return full_volume(attempt.word)


# These causes would also end the next pod, so a retry cannot help.
CAUSES: tuple[EndCheck, ...] = (
    configuration_refused,
    simulator_budget_spent,
    diverged,
    trainer_out_of_memory,
    evicted_for_storage,
    simulator_hung,
    stalled,
    storage_full,
)
ENDS: tuple[EndCheck, ...] = (
    ended_silently,
    completed,
    evicted_for_storage,
    replaced,
    disrupted,
    gone,
    deleted,
    ended_by_probe,
    interrupted,
    *CAUSES,
)


def why(attempt: EndedAttempt) -> Explanation:
    """Return the reason for which an attempt ended, by the first check that holds."""
    return first(ENDS, attempt) or explain(Reason.TRAINER_FAILED, how=attempt.words)


def first(checks: tuple[EndCheck, ...], attempt: EndedAttempt) -> Explanation | None:
    """Return the result of the first check that holds."""
    return next((found for check in checks if (found := check(attempt)) is not None), None)


def stop_of(job: JobView) -> Explanation | None:
    """Return the reason for which the operator stopped a replica, from the Job's annotation, or None."""
    if job.stopped is None:
        return None
    reason, message = job.stopped
    return Explanation(reason=Reason.known(reason), message=message or f"stopped: {reason}")


def paused(situation: ReplicaContext, why: str = "") -> Explanation:
    """Return the reason for a Job's suspension; `why` is Kueue's message, if the Job has a queue."""
    queue = (
        situation.seen.job.queue if situation.seen.job else ""
    ) or situation.job.spec.scheduling.queue_name
    if not queue:
        return explain(Reason.SUSPENDED, by=suspended_by(situation.job, situation.seen))
    taken, again = (TAKEN, AGAIN) if situation.counted.attempt else ("", "")
    return explain(Reason.QUEUED, queue=queue, taken=taken, why=f": {why}" if why else "", again=again)


def success(word: Termination | None) -> str:
    """Return the result of a complete training."""
    if word is None:
        return "the training is complete"
    rate = f", success rate {word.success_rate:.2f}" if word.success_rate is not None else ""
    if (interval := word.success_interval) is not None:
        rate += f" ({interval.low:.2f} to {interval.high:.2f}, {interval.episodes} episodes)"
    return f"the training is complete: {word.step} steps{rate}"


def _disrupted(attempt: EndedAttempt, words: str) -> Explanation:
    return explain(Reason.DISRUPTED, pod=attempt.name, words=words, next_pod=next_pod(attempt.situation))


def _memory(attempt: EndedAttempt) -> str:
    """Return the text about the attempt's simulators that ran out of memory, with the remedy, or ""."""
    uid = attempt.pod.uid if attempt.pod is not None else None
    killed = [
        f"{kill.container} ran out of memory and was killed ({limit_of(kill.limit)})"
        for kill in memory_kills(attempt.situation)
        if uid is not None and kill.pod == uid and kill.container != TRAINER
    ]
    remedy = "; raise spec.simulators[].resources.limits.memory"
    return f"; {', '.join(killed)}{remedy}" if killed else ""


def _of_code(attempt: EndedAttempt, code: ExitCode, reason: Reason) -> Explanation | None:
    return explain(reason, words=attempt.words) if attempt.code == code else None
