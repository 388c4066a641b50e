"""How a replica ended: the first check that knows.

A stop mark comes first, because it is why everything else happened; then what the trainer's exit code and
last word say; the Job's own words are the last resort.
"""

import re
from collections.abc import Callable
from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempts import CAUSES, Attempt, first, stop_of, success
from palaestra.decide.conditions import Told
from palaestra.decide.counting import exit_code
from palaestra.decide.moments import after
from palaestra.decide.situation import Situation, Verdict, told
from palaestra.decide.troubles import how_it_failed
from palaestra.observe.views import JobEnd, JobView, PodView

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
        return Verdict(phase=Phase.SUCCEEDED, told=told(Reason.SUCCEEDED, what=success(it.seen.termination)))
    if job.end is None and job.stopped is None:
        return None
    found = (reason for check in OUTCOMES if (reason := check(it, job)) is not None)
    return Verdict(phase=Phase.FAILED, told=next(found, _unknown(job)))


def stopped(_: Situation, job: JobView) -> Told | None:
    """We stopped it; the mark on the Job says why."""
    return stop_of(job)


def would_end_the_same(it: Situation, job: JobView) -> Told | None:
    """The last attempt ended by itself, for a cause that has a name."""
    pod = it.seen.pod
    name = pod.name if pod is not None else ""
    last = Attempt(it=it, number=it.counted.attempt, name=name, pod=pod, code=_code(it, job))
    return first(CAUSES, last)


def backoff_limit_spent(it: Situation, job: JobView) -> Told | None:
    """It was tried as often as it may be."""
    if job.end_reason != "BackoffLimitExceeded":
        return None
    how = how_it_failed(it, it.seen.pod) if it.seen.pod else "its pod is gone"
    return told(Reason.BACKOFF_LIMIT_SPENT, pods=job.failures, how=how)


OUTCOMES: tuple[OutcomeCheck, ...] = (
    stopped,
    would_end_the_same,
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


def _code(it: Situation, job: JobView) -> int | None:
    pod: PodView | None = it.seen.pod
    code = exit_code(pod) if pod is not None else None
    if code is not None or job.end_reason != "PodFailurePolicy":
        return code
    match = _EXIT_CODE.search(job.end_message)
    return int(match[1]) if match else None


def _unknown(job: JobView) -> Told:
    words = ": ".join(word for word in (job.end_reason, job.end_message) if word)
    return told(Reason.JOB_FAILED, words=words or "it does not say why")
