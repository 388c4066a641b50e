"""The ordered list of checks by which a replica that has not ended is judged.

docs/judging.md shows the same list. Each reconcile runs all checks, because a check may also return how long
it still waits. The class of a check that holds decides what follows:

- ended: the first one that holds is how the replica ended, and the others are ignored.
- final: the first one that holds stops the replica for good, by a mark on its Job.
- counted: the operator replaces the pod, at most `backoffLimit` times.
- waiting: the status shows its reason; nothing is ended or counted.
- shown: the status shows the state of the replica.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from palaestra.api.lines import one_line
from palaestra.api.reasons import LONGEST_MESSAGE, Reason
from palaestra.api.status import Phase
from palaestra.decide import final, outcomes, replacing, standing, troubles
from palaestra.decide.conditions import Told
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

    stop: Told | None = None
    replace: Told | None = None
    left_s: tuple[float, ...] = ()
    waits: tuple[Wait, ...] = ()
    trouble: Trouble | None = None


def judge(it: Situation) -> tuple[Verdict, Course]:
    """Return the verdict on a replica and what follows, by the first checks of the list that hold."""
    asked = [(kind, finding) for kind, check in JUDGED if (finding := check(it)) is not None]
    left_s = tuple(finding.left_s for _, finding in asked if finding.left_s > 0)
    waits = tuple(finding.wait for _, finding in asked if finding.wait is not None)
    holding = [(kind, finding) for kind, finding in asked if finding.left_s <= 0]
    if (end := _first(holding, Kind.ENDED)) is not None:
        return _verdict(it, end), Course(waits=waits)
    stop = _first(holding, Kind.FINAL)
    if stop is not None and it.seen.job is None:  # there is no Job to stop, and none will be created
        return Verdict(phase=Phase.FAILED, told=stop.told), Course()
    kind, shown = next((kind, each) for kind, each in holding if kind not in {Kind.ENDED, Kind.FINAL})
    replaced = kind is Kind.COUNTED and stop is None
    course = Course(
        stop=None if stop is None else stop.told,
        replace=shown.told if replaced else None,
        left_s=left_s,
        waits=waits,
        trouble=_trouble(it, shown.told) if FIRST_STEP in {each.key for each in waits} else None,
    )
    return _verdict(it, _refused(it, shown) if replaced else shown), course


def start_timeout(it: Situation) -> Finding | None:
    """Its first step has not come within `startTimeoutSeconds`; the reason is the cause of that wait."""
    if it.suspended or it.hold is not None or it.counted.furthest_step or _is_past_its_start(it):
        return None
    seconds = it.job.spec.start_timeout_s
    asked = (finding for kind, check in JUDGED if kind in SHOWN and (finding := check(it)) is not None)
    shown = next(finding.told for finding in asked if finding.left_s <= 0)
    trouble = _trouble(it, shown)
    reason = Reason.START_TIMEOUT if trouble is None else trouble.told.reason
    why = shown.message
    if trouble is not None and trouble.gone_s is not None:
        why = f"a moment ago: {trouble.told.message}"
    words = f"no step within {seconds} s, as long as startTimeoutSeconds allows; {why}"
    told = Told(reason=reason, message=one_line(words, LONGEST_MESSAGE))
    return after(it, Wait(key=FIRST_STEP, seconds=seconds), told)


def _trouble(it: Situation, shown: Told) -> Trouble | None:
    """Return the cause that delays the first step, also if the kubelet does not report it for a moment."""
    if shown.reason not in _NO_TROUBLE:
        return Trouble(told=shown)
    last, now_s = it.times.record.troubles.get(it.seen.index), it.times.clock_s
    if last is None:
        return None
    gone_s = now_s if last.gone_s is None else last.gone_s
    return replace(last, gone_s=gone_s) if now_s - gone_s <= MOMENT_S else None


def _is_past_its_start(it: Situation) -> bool:
    """Return whether the trainer runs and does not report that its simulators still start."""
    polled = it.seen.polled
    return standing.runs(it) and (polled is None or polled.status.phase != STARTING)


def _first(holding: Sequence[tuple[Kind, Finding]], kind: Kind) -> Finding | None:
    return next((finding for each, finding in holding if each is kind), None)


def _refused(it: Situation, shown: Finding) -> Finding:
    """Return why a pod has to be replaced, and why the API server refuses to evict it."""
    if not it.seen.denied:
        return shown
    words = one_line(f"{shown.told.message}; it is not replaced yet: {it.seen.denied}", LONGEST_MESSAGE)
    return replace(shown, told=Told(reason=shown.told.reason, message=words))


def _verdict(it: Situation, finding: Finding) -> Verdict:
    phase = Phase.RUNNING if standing.runs(it) else Phase.PENDING
    return Verdict(phase=finding.phase or phase, told=finding.told)


_NO_TROUBLE = frozenset({Reason.STARTING, Reason.TRAINING, Reason.DISRUPTED, Reason.INTERRUPTED})
SHOWN = frozenset({Kind.COUNTED, Kind.WAITING, Kind.SHOWN})  # sets the reason of a replica that continues

JUDGED: tuple[tuple[Kind, Check], ...] = (
    (Kind.ENDED, outcomes.job_is_complete),
    (Kind.ENDED, outcomes.stopped),
    (Kind.ENDED, outcomes.would_end_the_same),
    (Kind.ENDED, outcomes.backoff_limit_spent),
    (Kind.ENDED, outcomes.job_failed),
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
