"""Checks for a replica that continues and has no trouble: its state."""

from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempts import AGAIN, paused
from palaestra.decide.conditions import Told
from palaestra.decide.situation import Finding, Situation, found, told
from palaestra.decide.suspending import ended_by_suspension, unheeded

UNASKED = "; why that takes long was not asked, as too many others wait"
DESCRIBE = "; `kubectl describe` shows it"
DESCRIBE_WORKLOAD = "; `kubectl describe workload` shows it"  # no other object has Kueue's words


def held(it: Situation) -> Finding | None:
    """An object that the job names does not exist or is not for jobs, so nothing is created or resumed."""
    if it.hold is None:
        return None
    return Finding(told=it.hold.told, phase=Phase.PENDING if it.seen.job is None else Phase.SUSPENDED)


def suspending(it: Situation) -> Finding | None:
    """It is suspended, or was until a moment ago, and its pod still saves a checkpoint."""
    pod = it.pod if it.seen.job is not None else None
    if pod is None or not (it.suspended or ended_by_suspension(it.seen, pod)):
        return None
    by = paused(it).message if it.suspended else "then the next pod goes on from there"
    return Finding(told=told(Reason.SUSPENDING, pod=pod.name, by=by), phase=Phase.PENDING)


def suspended(it: Situation) -> Finding | None:
    """`spec.suspend` or a queue keeps it from running."""
    if not it.suspended:
        return None
    why = paused(it, it.seen.unadmitted or "")
    return Finding(told=replace(why, message=_with_words(it, why)), phase=Phase.SUSPENDED)


def _with_words(it: Situation, why: Told) -> str:
    """Return the message of `why`; after a restart the operator keeps Kueue's words until it has asked."""
    if it.seen.unasked:
        return why.message + UNASKED + (DESCRIBE_WORKLOAD if why.reason == Reason.QUEUED else DESCRIBE)
    before, plain = it.old.message or "", why.message.removesuffix(AGAIN)
    waited = it.old.reason == why.reason == Reason.QUEUED and before.startswith(f"{plain}: ")
    return before if waited and it.seen.unadmitted is None else why.message


def trainer_has_ended(it: Situation) -> Finding | None:
    """The trainer has ended, but its pod has not."""
    pod = it.seen.pod if it.seen.job is not None else None
    if pod is None or pod.trainer is None or pod.trainer.exit is None:
        return None
    what = f"attempt {it.counted.attempt} has ended, its simulators are stopped"
    return Finding(told=told(Reason.TRAINING, what=what), phase=Phase.RUNNING)


def trains(it: Situation) -> Finding | None:
    """The trainer runs."""
    if not runs(it):
        return None
    if it.seen.polled is not None and not it.trains:
        return found(Reason.STARTING, what="its simulators are on their way")
    return found(Reason.TRAINING, what=f"attempt {it.counted.attempt} trains{unheeded(it.job, it.seen)}")


def starts(it: Situation) -> Finding | None:
    """Its objects are about to be created, or its containers start."""
    there = [*it.seen.in_the_way, *([it.pod.name] if it.pod is not None else [])]
    if it.seen.job is None:
        waits = f"waits for pod {there[0]} to end" if there else "is about to be created"
        return found(Reason.STARTING, what=waits)
    if it.seen.pod is None:
        what = "its pod is about to be created"
    else:
        what = "its last pod has ended" if it.seen.pod.ended else "its containers start"
    return found(Reason.STARTING, what=what + (UNASKED + DESCRIBE if it.seen.unasked else ""))


def runs(it: Situation) -> bool:
    """Return whether the trainer's container runs, in a pod of the replica's Job."""
    trainer = it.pod.trainer if it.pod is not None and it.seen.job is not None else None
    return trainer is not None and trainer.running_since is not None
