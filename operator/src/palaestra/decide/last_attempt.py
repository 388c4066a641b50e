"""The record of the newest ended attempt, which the status keeps after Kubernetes has deleted the pod's log.

The record is written as soon as the trainer has ended, and stays after the pod is deleted. If no reconcile
observed the end of a pod, the record is written once the next pod exists.
"""

from palaestra.api.attempt_status import Fault, LastAttempt
from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.status import TERMINAL
from palaestra.api.text import one_line
from palaestra.decide.attempt_end import EndedAttempt, of_pod, why
from palaestra.decide.explanation import Explanation
from palaestra.decide.pod_end import left_by
from palaestra.decide.progress import LONGEST_NAME
from palaestra.decide.replica_context import ReplicaContext, ReplicaVerdict
from palaestra.decide.restart_counts import exit_code, newer_pods
from palaestra.observe.json_access import MOST_COUNT, as_time
from palaestra.observe.models import PodView
from palaestra_protocol.pod.status import MOST_FAULTS, MOST_LINE, MOST_LINES, FaultRecord


def last_attempt(situation: ReplicaContext, end: ReplicaVerdict | None = None) -> LastAttempt | None:
    """Return the record of the newest ended attempt; None if no attempt has ended.

    `end` is the phase and reason of an ended replica. If the pod of the last attempt was deleted, the record
    of this attempt gets the same reason.
    """
    known, newest = situation.old.last_attempt, situation.seen.pod
    attempt = (
        of_pod(situation, newest, situation.counted.attempt)
        if newest and has_ended(newest)
        else _replaced(situation)
    )
    if attempt is not None and not (attempt.pod is None and _knows(known, attempt.number)):
        return _record(attempt, why(attempt))
    if (
        end is not None
        and newest is None
        and situation.counted.attempt
        and not _knows(known, situation.counted.attempt)
    ):
        number, name = situation.counted.attempt, situation.counted.pod.name if situation.counted.pod else ""
        return _record(
            EndedAttempt(situation=situation, number=number, name=name, pod=None, code=None), end.explanation
        )
    return known


def late_word(situation: ReplicaContext) -> LastAttempt | None:
    """Return the record of an ended replica's last attempt, even if the pod's end is observed only now.

    If the pod is deleted without a termination message, the record has the reason of the replica's end. The
    caches of Jobs and pods are updated in any order, and the record must not depend on that order.
    """
    known, newest, named = situation.old.last_attempt, situation.seen.pod, situation.old.pod
    if named is None or _knows(known, situation.old.attempt):
        return known
    if newest is None and situation.old.phase in TERMINAL:
        gone = EndedAttempt(
            situation=situation, number=situation.old.attempt, name=named.name, pod=None, code=None
        )
        reason = Reason(situation.old.reason or Reason.JOB_FAILED)
        return _record(gone, Explanation(reason=reason, message=situation.old.message or ""))
    if newest is None or newest.uid != named.uid or not has_ended(newest):
        return known
    attempt = of_pod(situation, newest, situation.old.attempt)
    return _record(attempt, why(attempt))


def has_ended(pod: PodView) -> bool:
    """Return whether a pod or its trainer has ended."""
    return pod.ended or exit_code(pod) is not None


def _knows(known: LastAttempt | None, number: int) -> bool:
    return known is not None and known.attempt >= number


def _replaced(situation: ReplicaContext) -> EndedAttempt | None:
    """Return the attempt that the newest pod replaced, if the newest pod is observed for the first time."""
    named, newer = situation.old.pod, newer_pods(situation.old, situation.seen.pods)
    if not newer:
        return None
    if len(newer) > 1:
        return of_pod(situation, newer[-2], situation.counted.attempt - 1)
    if named is None:
        return None
    pod = next((pod for pod in situation.seen.pods if pod.uid == named.uid), None)
    if pod is not None:
        return of_pod(situation, pod, situation.old.attempt)
    return EndedAttempt(
        situation=situation, number=situation.old.attempt, name=named.name, pod=None, code=None
    )


def _record(attempt: EndedAttempt, explanation: Explanation) -> LastAttempt:
    word = attempt.word
    restarts = word.restarts if word is not None else None
    if restarts is None:
        restarts = _counted_restarts(attempt)
    return LastAttempt(
        attempt=attempt.number,
        exit_code=attempt.code,
        reason=explanation.reason.value,
        message=one_line(explanation.message, LONGEST_MESSAGE),
        log=_log(attempt),
        faults=tuple(_faults(word.faults if word is not None else ())),
        restarts=min(restarts or 0, MOST_COUNT),
    )


def _counted_restarts(attempt: EndedAttempt) -> int:
    """Return the counted restarts of simulators in an attempt whose termination message has no number."""
    now, before = attempt.situation.counted, attempt.situation.old
    for counts in (now, before):
        if counts.pod is not None and counts.pod.name == attempt.name:
            return counts.simulator_restarts
    return 0


def _log(attempt: EndedAttempt) -> tuple[str, ...]:
    """Return the last lines of a trainer's log: from its termination message, or else from the pod."""
    lines: tuple[str, ...] = ()
    if attempt.word is not None:
        lines = attempt.word.log
    elif attempt.pod is not None:
        lines = tuple(left_by(attempt.pod).splitlines())
    shortened = (one_line(line, MOST_LINE) for line in lines)
    return tuple(line for line in shortened if line)[-MOST_LINES:]


def _faults(records: tuple[FaultRecord, ...]) -> list[Fault]:
    """Return the last faults, without faults whose time is not a valid date."""
    timed = [(record, at) for record in records if (at := as_time(record.time)) is not None]
    return [
        Fault(
            time=at,
            simulator=one_line(each.simulator, LONGEST_NAME) or "unnamed",
            kind=each.kind,
            fact=one_line(each.fact, MOST_LINE),
            step=min(each.step, MOST_COUNT),
        )
        for each, at in timed[-MOST_FAULTS:]
    ]
