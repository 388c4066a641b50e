"""The end of a replica whose Job has ended or was stopped.

`palaestra.decide.replica_policy` has the order of these checks. A stop mark comes first, because the stop
caused the later ends of trainer and Job. The trainer's exit code and termination message come next, and the
Job's own message comes last.
"""

import re
from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempt_end import CAUSES, EndedAttempt, ended_silently, first, of_pod, stop_of, success
from palaestra.decide.attempt_end import why as why_of
from palaestra.decide.clocks import Wait
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.pod_end import how_it_failed
from palaestra.decide.replica_context import Finding, ReplicaContext, after
from palaestra.decide.restart_counts import exit_code
from palaestra.observe.models import JobEnd, JobView, PodView
from palaestra_protocol.pod.status import ExitCode

LAST_WORD_S = 30  # longest wait in seconds for the end of a pod, after the end of its Job
# This expression finds the exit code in a failed Job's message, in case the pod was deleted.
_EXIT_CODE = re.compile(r"exit code (\d{1,3})\b")


def ended_by_others(situation: ReplicaContext) -> Finding | None:
    """The Job is complete, but its trainer reported no end of training: a library ended the process."""
    job, pod = situation.seen.job, situation.seen.pod
    if job is None or job.end is not JobEnd.COMPLETE or pod is None:
        return None
    why = ended_silently(of_pod(situation, pod, situation.counted.attempt))
    return None if why is None else _ended(situation, job, why)


def job_is_complete(situation: ReplicaContext) -> Finding | None:
    """The Job is complete, and so is the training."""
    job = situation.seen.job
    if job is None or job.end is not JobEnd.COMPLETE:
        return None
    why = explain(Reason.SUCCEEDED, what=success(situation.seen.termination))
    return replace(_ended(situation, job, why), phase=Phase.SUCCEEDED)


def stopped(situation: ReplicaContext) -> Finding | None:
    """The operator stopped the replica; an annotation of the Job has the reason."""
    job = situation.seen.job
    why = stop_of(job) if job is not None else None
    return None if job is None or why is None else _with_phase(_ended(situation, job, why))


def trainer_was_done(situation: ReplicaContext) -> Finding | None:
    """The Job has failed, but its trainer had completed: a foreign container has failed."""
    job, pod = situation.seen.job, situation.seen.pod
    if job is None or job.end is not JobEnd.FAILED or pod is None or exit_code(pod) != ExitCode.DONE:
        return None
    return _with_phase(_ended(situation, job, why_of(of_pod(situation, pod, situation.counted.attempt))))


def _with_phase(end: Finding) -> Finding:
    """Return an end with the phase of its reason."""
    done = end.explanation.reason is Reason.SUCCEEDED
    return replace(end, phase=Phase.SUCCEEDED if done else Phase.FAILED)


def would_end_the_same(situation: ReplicaContext) -> Finding | None:
    """The Job has failed, and its last attempt ended for a known cause that a retry cannot remove."""
    job, pod = situation.seen.job, situation.seen.pod
    if job is None or job.end is None:
        return None
    name = pod.name if pod is not None else ""
    last = EndedAttempt(
        situation=situation, number=situation.counted.attempt, name=name, pod=pod, code=_code(situation, job)
    )
    why = first(CAUSES, last)
    return None if why is None else _ended(situation, job, why)


def backoff_limit_spent(situation: ReplicaContext) -> Finding | None:
    """The Job has failed: its pods failed more often than `backoffLimit` allows."""
    job = situation.seen.job
    if job is None or job.end_reason != "BackoffLimitExceeded":
        return None
    how = how_it_failed(situation, situation.seen.pod) if situation.seen.pod else "its pod is gone"
    return _ended(situation, job, explain(Reason.BACKOFF_LIMIT_SPENT, pods=job.failures, how=how))


def job_failed(situation: ReplicaContext) -> Finding | None:
    """The Job has failed for another cause; the replica's reason has the Job's own message."""
    job = situation.seen.job
    if job is None or job.end is None:
        return None
    words = ": ".join(word for word in (job.end_reason, job.end_message) if word)
    return _ended(situation, job, explain(Reason.JOB_FAILED, words=words or "no reason was given"))


def _ended(situation: ReplicaContext, job: JobView, why: Explanation) -> Finding:
    """Return an end that holds as soon as the pod's end is observed too, or after `LAST_WORD_S`.

    The watches of Jobs and pods have different delays, so the Job's end may be observed first. Only the pod
    has the termination message.
    """
    if job.stopped is not None or situation.pod is None:
        return Finding(explanation=why, phase=Phase.FAILED)
    wait = Wait(key=("last word", job.uid), seconds=LAST_WORD_S)
    return replace(after(situation, wait, why), phase=Phase.FAILED)


def _code(situation: ReplicaContext, job: JobView) -> int | None:
    pod: PodView | None = situation.seen.pod
    code = exit_code(pod) if pod is not None else None
    if code is not None or job.end_reason != "PodFailurePolicy":
        return code
    match = _EXIT_CODE.search(job.end_message)
    return int(match[1]) if match else None
