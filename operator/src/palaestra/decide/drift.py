"""Changes by other clients in the operator's objects: each is reported once, and none is reverted."""

from collections.abc import Iterator

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.decide.decision import EmittedEvent, EventType
from palaestra.observe.models import JobView, Observed


def edits(job: TrainingJob, observed: Observed) -> Iterator[EmittedEvent]:
    """Yield an event for each edit that is still there; its message is unique, so it is written once."""
    for name, generation in observed.edited:
        fact = f"spec, generation {generation}; if you delete it, the operator creates it again as planned"
        yield _event(f"NetworkPolicy {name}", fact, None)
    for seen in observed.replicas:
        if seen.job is not None and seen.job.end is None and (fact := _changed(job, seen.job)):
            yield _event(f"Job {seen.job.name}", fact, seen.index)


def _changed(job: TrainingJob, seen: JobView) -> str:
    """Return the settings of a Job that differ from the plan; "" if none does."""
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
