"""How a replica ended: the first check that knows.

A stop mark comes first, because it is why everything else happened; then what the trainer's exit code and
last word say; the Job's own words are the last resort.
"""

import re
from collections.abc import Callable
from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.conditions import Told
from palaestra.decide.counting import exit_code
from palaestra.decide.moments import after
from palaestra.decide.situation import Situation, Verdict, told
from palaestra.decide.troubles import how_it_failed, killed_for_memory, storage_eviction
from palaestra.observe.views import JobEnd, JobView, PodView
from palaestra_sim.protocol.status import ExitCode

OutcomeCheck = Callable[[Situation, JobView], Told | None]

LAST_WORD_S = 30  # after its Job has ended, in which a pod's end is seen too
_EXIT_CODE = re.compile(r"exit code (\d{1,3})\b")  # in the Job's words, when the pod is gone


def ended(it: Situation) -> Verdict | None:
    """Return the verdict about a replica whose Job is stopped or has ended; None: it goes on."""
    job = it.seen.job
    by = last_word_by(it)
    if job is None or (by is not None and it.now < by):
        return None
    if job.end is JobEnd.COMPLETE:
        return Verdict(phase=Phase.SUCCEEDED, told=told(Reason.SUCCEEDED, what=_success(it)))
    if job.end is None and job.stopped is None:
        return None
    found = (reason for check in OUTCOMES if (reason := check(it, job)) is not None)
    return Verdict(phase=Phase.FAILED, told=next(found, _unknown(job)))


def stopped(_: Situation, job: JobView) -> Told | None:
    """We stopped it; the mark on the Job says why."""
    if job.stopped is None:
        return None
    reason, message = job.stopped
    known = Reason(reason) if reason in set(Reason) else Reason.JOB_FAILED
    return Told(reason=known, message=message or f"stopped: {reason}")


def configuration_refused(it: Situation, job: JobView) -> Told | None:
    """The trainer says: do not try this again."""
    return _of_code(it, job, ExitCode.CONFIGURATION, Reason.CONFIGURATION_REFUSED)


def fault_budget_spent(it: Situation, job: JobView) -> Told | None:
    """The trainer gave up on a simulator."""
    return _of_code(it, job, ExitCode.FAULT_BUDGET, Reason.FAULT_BUDGET_SPENT)


def diverged(it: Situation, job: JobView) -> Told | None:
    """The learner did."""
    return _of_code(it, job, ExitCode.DIVERGED, Reason.DIVERGED)


def trainer_out_of_memory(it: Situation, _: JobView) -> Told | None:
    """Trying again needs as much memory."""
    pod = it.seen.pod
    if pod is None or pod.trainer is None or not killed_for_memory(pod.trainer):
        return None
    failures = it.seen.job.failures if it.seen.job else 0
    return told(
        Reason.TRAINER_OUT_OF_MEMORY, times=f" in the last of {failures} pods" if failures > 1 else ""
    )


def stalled_too_often(it: Situation, job: JobView) -> Told | None:
    """The trainer's watchdog ended it, each time."""
    if _code(it, job) != ExitCode.STALLED:
        return None
    word = it.seen.termination
    what = word.reason if word else f"no environment step for {it.job.spec.stall_deadline_seconds} s"
    return told(Reason.STALLED, what=what)


def evicted_for_storage(it: Situation, _: JobView) -> Told | None:
    """The pod wrote more than it may."""
    return None if it.seen.pod is None else storage_eviction(it.seen.pod)


def backoff_limit_spent(it: Situation, job: JobView) -> Told | None:
    """It was tried as often as it may be."""
    if job.end_reason != "BackoffLimitExceeded":
        return None
    how = how_it_failed(it, it.seen.pod) if it.seen.pod else "its pod is gone"
    return told(Reason.BACKOFF_LIMIT_SPENT, pods=job.failures, how=how)


OUTCOMES: tuple[OutcomeCheck, ...] = (
    stopped,
    configuration_refused,
    fault_budget_spent,
    diverged,
    trainer_out_of_memory,
    evicted_for_storage,
    stalled_too_often,
    backoff_limit_spent,
)


def last_word_by(it: Situation) -> datetime | None:
    """Return until when to wait for the end of a pod whose Job has ended; None: there is nothing to wait for.

    Two watches have two ages: the Job's end may be seen before the pod's, and with it the last word.
    """
    job = it.seen.job
    if job is None or job.ended is None or job.stopped is not None or it.pod is None:
        return None
    return after(job.ended, LAST_WORD_S)


def _success(it: Situation) -> str:
    word = it.seen.termination
    if word is None:
        return "the training is complete"
    rate = f", success rate {word.success_rate:.2f}" if word.success_rate is not None else ""
    return f"the training is complete: {word.step} steps{rate}"


def _of_code(it: Situation, job: JobView, code: ExitCode, reason: Reason) -> Told | None:
    if _code(it, job) != code:
        return None
    return told(reason, words=_words(it))


def _code(it: Situation, job: JobView) -> int | None:
    pod: PodView | None = it.seen.pod
    code = exit_code(pod) if pod is not None else None
    if code is not None or job.end_reason != "PodFailurePolicy":
        return code
    match = _EXIT_CODE.search(job.end_message)
    return int(match[1]) if match else None


def _words(it: Situation) -> str:
    if it.seen.termination is not None:
        return it.seen.termination.reason
    return how_it_failed(it, it.seen.pod) if it.seen.pod is not None else "its pod is gone; no last word"


def _unknown(job: JobView) -> Told:
    words = ": ".join(word for word in (job.end_reason, job.end_message) if word)
    return told(Reason.JOB_FAILED, words=words or "it does not say why")
