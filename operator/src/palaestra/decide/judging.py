"""The ordered list of checks by which a replica that has not ended is judged.

`make golden` writes the list into docs/judging.md. Each reconcile runs all checks, because a check may also
return how long it still waits. The class of a check that holds decides what follows:

- ended: the first one that holds is how the replica ended, and the others are ignored.
- final: the first one that holds stops the replica for good, by a mark on its Job.
- counted: the operator replaces the pod, or its Job does, at most `backoffLimit` times.
- waiting: the status shows its reason; nothing is ended or counted.
- shown: the status shows the state of the replica.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from palaestra.api.lines import one_line
from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.status import Phase
from palaestra.decide import final, outcomes, outliving, replacing, standing, troubles
from palaestra.decide.conditions import Explanation
from palaestra.decide.situation import STARTING, Check, Finding, Situation, Verdict, after
from palaestra.decide.times import Trouble, Wait

FIRST_STEP = ("first step",)  # the key of the wait for the first step
MOMENT_S = 60  # within which a kubelet that restarted, or tries again, reports a reason again


class Kind(StrEnum):
    """The class of a check: what follows if it holds."""

    ENDED = "ended"
    FINAL = "final"
    COUNTED = "counted"
    WAITING = "waiting"
    SHOWN = "shown"


@dataclass(frozen=True, slots=True, kw_only=True)
class Course:
    """The actions and waits that follow for a replica.

    Attributes:
        stop: why to stop it for good; None: it continues.
        replace: why to replace its pod; None: the pod stays.
        left_s: seconds after which the verdict may change by time alone.
        waits: the open waits, kept until the next reconcile.
        trouble: the cause that delays its first step, kept too; None if there is none with a name, or if the
            first step was done.
    """

    stop: Explanation | None = None
    replace: Explanation | None = None
    left_s: tuple[float, ...] = ()
    waits: tuple[Wait, ...] = ()
    trouble: Trouble | None = None


def judge(situation: Situation) -> tuple[Verdict, Course]:
    """Return the verdict on a replica and what follows, by the first checks of the list that hold."""
    asked = [(kind, finding) for kind, check in JUDGED if (finding := check(situation)) is not None]
    left_s = tuple(finding.left_s for _, finding in asked if finding.left_s > 0)
    waits = tuple(finding.wait for _, finding in asked if finding.wait is not None)
    holding = [(kind, finding) for kind, finding in asked if finding.left_s <= 0]
    if (end := _first(holding, Kind.ENDED)) is not None:
        return _verdict(situation, end), Course(waits=waits)
    stop = _first(holding, Kind.FINAL)
    if stop is not None and situation.seen.job is None:  # there is no Job to stop, and none will be created
        return Verdict(phase=Phase.FAILED, explanation=stop.explanation), Course()
    kind, shown = next((kind, each) for kind, each in holding if kind not in {Kind.ENDED, Kind.FINAL})
    replaced = kind is Kind.COUNTED and stop is None
    course = Course(
        stop=None if stop is None else stop.explanation,
        replace=shown.explanation if replaced else None,
        left_s=left_s,
        waits=waits,
        trouble=_trouble(situation, shown.explanation)
        if FIRST_STEP in {wait.key for wait in waits}
        else None,
    )
    return _verdict(situation, _refused(situation, shown) if replaced else shown), course


def start_timeout(situation: Situation) -> Finding | None:
    """Its first step has not come within `startTimeoutSeconds`; the reason is the cause of that wait."""
    if (
        situation.suspended
        or situation.hold is not None
        or situation.counted.furthest_step
        or _is_past_its_start(situation)
    ):
        return None
    seconds = situation.job.spec.start_timeout_s
    asked = (finding for kind, check in JUDGED if kind in SHOWN and (finding := check(situation)) is not None)
    shown = next(finding.explanation for finding in asked if finding.left_s <= 0)
    trouble = _trouble(situation, shown)
    reason = Reason.START_TIMEOUT if trouble is None else trouble.explanation.reason
    why = shown.message
    if trouble is not None and trouble.gone_s is not None:
        why = f"a moment ago: {trouble.explanation.message}"
    words = f"no step within {seconds} s, as long as startTimeoutSeconds allows; {why}"
    explanation = Explanation(reason=reason, message=one_line(words, LONGEST_MESSAGE))
    return after(situation, Wait(key=FIRST_STEP, seconds=seconds), explanation)


def _trouble(situation: Situation, shown: Explanation) -> Trouble | None:
    """Return the cause that delays the first step, also if the kubelet does not report it for a moment."""
    if shown.reason not in _NO_TROUBLE:
        return Trouble(explanation=shown)
    last, now_s = situation.times.record.troubles.get(situation.seen.index), situation.times.clock_s
    if last is None:
        return None
    gone_s = now_s if last.gone_s is None else last.gone_s
    return replace(last, gone_s=gone_s) if now_s - gone_s <= MOMENT_S else None


def _is_past_its_start(situation: Situation) -> bool:
    """Return whether the trainer runs and does not report that its simulators still start."""
    polled = situation.seen.polled
    return standing.runs(situation) and (polled is None or polled.status.phase != STARTING)


def _first(holding: Sequence[tuple[Kind, Finding]], kind: Kind) -> Finding | None:
    return next((finding for each, finding in holding if each is kind), None)


def _refused(situation: Situation, shown: Finding) -> Finding:
    """Return why a pod has to be replaced, and why the API server refuses to evict it."""
    if not situation.seen.denied:
        return shown
    words = one_line(
        f"{shown.explanation.message}; it is not replaced yet: {situation.seen.denied}", LONGEST_MESSAGE
    )
    return replace(shown, explanation=Explanation(reason=shown.explanation.reason, message=words))


def _verdict(situation: Situation, finding: Finding) -> Verdict:
    phase = Phase.RUNNING if standing.runs(situation) else Phase.PENDING
    return Verdict(phase=finding.phase or phase, explanation=finding.explanation)


_NO_TROUBLE = frozenset({Reason.STARTING, Reason.TRAINING, Reason.DISRUPTED, Reason.INTERRUPTED})
SHOWN = frozenset({Kind.COUNTED, Kind.WAITING, Kind.SHOWN})  # sets the reason of a replica that continues

JUDGED: tuple[tuple[Kind, Check], ...] = (
    (Kind.ENDED, outcomes.ended_by_others),
    (Kind.ENDED, outcomes.job_is_complete),
    (Kind.ENDED, outcomes.stopped),
    (Kind.ENDED, outcomes.trainer_was_done),
    (Kind.ENDED, outcomes.would_end_the_same),
    (Kind.ENDED, outcomes.backoff_limit_spent),
    (Kind.ENDED, outcomes.job_failed),
    (Kind.FINAL, outliving.trainer_is_done),
    (Kind.FINAL, final.active_deadline),
    (Kind.FINAL, final.cannot_be_planned),
    (Kind.FINAL, final.image_name_is_invalid),
    (Kind.FINAL, replacing.replaced_too_often),
    (Kind.FINAL, final.no_progress),
    (Kind.FINAL, start_timeout),
    (Kind.WAITING, standing.held),
    (Kind.WAITING, troubles.objects_refused),
    (Kind.WAITING, troubles.node_lost),
    (Kind.SHOWN, standing.suspending),
    (Kind.SHOWN, standing.suspended),
    (Kind.WAITING, troubles.name_taken),
    (Kind.WAITING, troubles.old_pod_holds_claim),
    (Kind.WAITING, troubles.pods_refused),
    (Kind.COUNTED, replacing.marked),
    (Kind.COUNTED, replacing.restart_policy_dropped),
    (Kind.WAITING, troubles.unschedulable),
    (Kind.WAITING, troubles.volume_not_mounted),
    (Kind.WAITING, troubles.image_does_not_come),
    (Kind.WAITING, troubles.container_refused),
    (Kind.COUNTED, replacing.trainer_never_started),
    (Kind.COUNTED, replacing.stalled),
    (Kind.COUNTED, replacing.ended_by_probe),
    (Kind.COUNTED, outliving.pod_outlives_trainer),
    (Kind.WAITING, outliving.kept_alive),
    (Kind.WAITING, troubles.sidecar_out_of_memory),
    (Kind.WAITING, troubles.sidecar_crash_loops),
    (Kind.WAITING, troubles.simulator_not_up),
    (Kind.WAITING, troubles.pod_filled_its_storage),
    (Kind.WAITING, troubles.pod_was_taken),
    (Kind.WAITING, troubles.volume_is_full),
    (Kind.WAITING, troubles.pod_failed),
    (Kind.SHOWN, standing.trainer_has_ended),
    (Kind.SHOWN, standing.trains),
    (Kind.SHOWN, standing.starts),
)
