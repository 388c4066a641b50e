"""The events about changes between two statuses, about actions, and about edits of the operator's objects."""

from collections.abc import Iterator, Sequence

from palaestra.api import TrainingJob
from palaestra.api.reason_texts import ROWS, say
from palaestra.api.reasons import Reason
from palaestra.api.status import Condition, ConditionStatus, ConditionType, Phase, ReplicaStatus, Status
from palaestra.decide.decision import (
    Action,
    Create,
    Delete,
    Discard,
    EmittedEvent,
    EventType,
    Replace,
    SetSuspend,
    Stop,
)
from palaestra.decide.job_status import condition
from palaestra.decide.pod_end import limit_of
from palaestra.observe.models import JobView, Observed
from palaestra.plan.replica import TRAINER

_ENDS = (ConditionType.SUCCEEDED, ConditionType.FAILED)
_BY_ACTION = {Reason.PLANNED, Reason.RESUMED, Reason.EXPIRED}
_BY_ATTEMPT = {Reason.DISRUPTED}  # one event for each attempt, even if no reconcile observed its end


def emitted(reason: Reason, message: str, replica: int | None = None) -> EmittedEvent:
    """Return the event for a reason, with the event type from docs/reference/reasons.md."""
    kind = EventType.WARNING if ROWS[reason].warning else EventType.NORMAL
    return EmittedEvent(type=kind, reason=reason, message=message, replica=replica)


def of_change(old: Status, new: Status) -> Iterator[EmittedEvent]:
    """Yield an event for each change of a condition or replica on which a person or program may wait."""
    yield from _of_condition(old, new, ConditionType.ACCEPTED)
    before = {replica.index: replica for replica in old.replicas}
    for replica in new.replicas:
        yield from _of_replica(before.get(replica.index), replica)
        yield from _of_attempt(before.get(replica.index), replica)
        yield from _of_memory(before.get(replica.index), replica)
        yield from _of_lost_run(before.get(replica.index), replica)
    for kind in _ENDS:
        yield from _of_condition(old, new, kind)


def of_actions(actions: Sequence[Action], replicas: Sequence[ReplicaStatus] = ()) -> Iterator[EmittedEvent]:
    """Yield an event for each action; one event names all created objects of a replica."""
    saved = {replica.index for replica in replicas if replica.last_checkpoint is not None}
    created: dict[int | None, list[str]] = {}
    for action in actions:
        match action:
            case Create(object=thing, replica=replica):
                created.setdefault(replica, []).append(f"{thing['kind']} {thing['metadata']['name']}")
            case Stop(reason=reason, message=message, replica=replica):
                yield emitted(reason, message, replica)
            case SetSuspend(suspend=False, replica=replica):
                what = "resumes from the last checkpoint" if replica in saved else "continues"
                yield emitted(Reason.RESUMED, say(Reason.RESUMED, what=what), replica)
            case Discard() | Replace() | SetSuspend():  # another event reports the replica's end or reason
                continue
            case Delete():
                yield emitted(Reason.EXPIRED, say(Reason.EXPIRED, seconds=action.after_s))
    for replica, names in created.items():
        yield emitted(Reason.PLANNED, say(Reason.PLANNED, objects=", ".join(names)), replica)


def _of_condition(old: Status, new: Status, kind: ConditionType) -> Iterator[EmittedEvent]:
    """Yield an event if a condition changed; Succeeded and Failed are reported only if true."""
    before, now = condition(old, kind), condition(new, kind)
    silent = now is None or (kind in _ENDS and now.status is ConditionStatus.FALSE)
    if now is None or silent or (before is not None and _same(before, now)):
        return
    yield emitted(Reason(now.reason), now.message)


def _same(one: Condition, other: Condition) -> bool:
    return (one.status, one.reason) == (other.status, other.reason)


def _of_replica(old: ReplicaStatus | None, new: ReplicaStatus) -> Iterator[EmittedEvent]:
    before = (old.phase, old.reason) if old is not None else (Phase.PENDING, None)
    if before == (new.phase, new.reason) or new.reason is None or new.message is None:
        return
    reason = Reason(new.reason)
    if reason not in _BY_ACTION | _BY_ATTEMPT:
        yield emitted(reason, new.message, new.index)


def _of_attempt(old: ReplicaStatus | None, new: ReplicaStatus) -> Iterator[EmittedEvent]:
    """Yield the event about a disrupted attempt, even if its pod is deleted and the next pod runs."""
    last, before = new.last_attempt, old.last_attempt if old is not None else None
    if last is None or last.reason not in _BY_ATTEMPT:
        return
    if before is None or (before.attempt, before.reason) != (last.attempt, last.reason):
        yield emitted(Reason(last.reason), last.message, new.index)


def _of_memory(old: ReplicaStatus | None, new: ReplicaStatus) -> Iterator[EmittedEvent]:
    """Yield an event for each container that ran out of memory, unless the replica's event reports it."""
    before = {kill.container: kill.times for kill in old.memory_kills} if old is not None else {}
    reported = {event.message for event in _of_replica(old, new)}
    for kill in new.memory_kills:
        whose = Reason.TRAINER_OUT_OF_MEMORY if kill.container == TRAINER else Reason.SIMULATOR_OUT_OF_MEMORY
        message = say(whose, container=kill.container, limit=limit_of(kill.limit), times=kill.times)
        if kill.times > before.get(kill.container, 0) and message not in reported:
            yield emitted(whose, message, new.index)


def _of_lost_run(old: ReplicaStatus | None, new: ReplicaStatus) -> Iterator[EmittedEvent]:
    """Yield an event if a person has restarted a lost run since the old status."""
    before = old.lost.restarted if old is not None and old.lost is not None else None
    if new.lost is not None and new.lost.restarted is not None and new.lost.restarted != before:
        yield emitted(Reason.RUN_RESTARTED, say(Reason.RUN_RESTARTED, step=new.lost.step), new.index)


def edits(job: TrainingJob, observed: Observed) -> Iterator[EmittedEvent]:
    """Yield an event for each current edit by another client; the operator does not revert edits.

    Each edit has a unique message, so its event is written once.
    """
    for name, generation in observed.edited:
        fact = f"spec, generation {generation}; if you delete it, the operator creates it again as planned"
        yield _event(f"NetworkPolicy {name}", fact, None)
    for seen in observed.replicas:
        if seen.job is not None and seen.job.end is None and (fact := _changed(job, seen.job)):
            yield _event(f"Job {seen.job.name}", fact, seen.index)


def _changed(job: TrainingJob, seen: JobView) -> str:
    """Return the text about the settings of a Job that differ from the plan, or ""."""
    planned = {
        "parallelism": 1,
        "backoffLimit": job.spec.backoff_limit,
        "activeDeadlineSeconds": None if seen.stopped is None else 1,
        "ttlSecondsAfterFinished": None,
    }
    now = {**planned, **seen.settings}
    changes = (
        f"{name} {now[name]} instead of {planned[name]}" for name in planned if now[name] != planned[name]
    )
    return ", ".join(changes)


def _event(what: str, fact: str, replica: int | None) -> EmittedEvent:
    message = say(Reason.EDITED, what=what, fact=fact)
    return EmittedEvent(
        type=EventType.WARNING, reason=Reason.EDITED, message=message, replica=replica, once=True
    )
