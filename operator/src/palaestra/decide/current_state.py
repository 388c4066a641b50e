"""The checks that report the state of a replica that has no waiting reason."""

from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempt_end import AGAIN, paused
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.replica_context import Finding, ReplicaContext, found
from palaestra.decide.suspend import ended_by_suspension, unheeded
from palaestra.observe.models import PodView

UNASKED = "; the cause was not looked up, because too many other replicas wait"
DESCRIBE = "; `kubectl describe` shows it"
DESCRIBE_WORKLOAD = "; `kubectl describe workload` shows it"  # only the Workload has Kueue's message


def held(situation: ReplicaContext) -> Finding | None:
    """The replica must not start: for example, its run is lost, or a named object does not exist."""
    if situation.hold is None:
        return None
    job = situation.seen.job
    phase = Phase.PENDING if job is None else Phase.SUSPENDED if job.suspended else None
    return Finding(explanation=situation.hold.explanation, phase=phase)


def suspending(situation: ReplicaContext) -> Finding | None:
    """The replica is suspended, or was just resumed, and its old pod still saves a checkpoint."""
    pod = situation.pod if situation.seen.job is not None else None
    if pod is None or not (situation.suspended or ended_by_suspension(situation.seen, pod)):
        return None
    by = paused(situation).message if situation.suspended else "then the next pod continues from there"
    return Finding(explanation=explain(Reason.SUSPENDING, pod=pod.name, by=by), phase=Phase.PENDING)


def suspended(situation: ReplicaContext) -> Finding | None:
    """`spec.suspend` or a queue keeps the replica from running."""
    if not situation.suspended:
        return None
    why = paused(situation, situation.seen.unadmitted or "")
    return Finding(explanation=replace(why, message=_with_words(situation, why)), phase=Phase.SUSPENDED)


def _with_words(situation: ReplicaContext, why: Explanation) -> str:
    """Return the message of `why`, with Kueue's message if it is known.

    After a restart of the operator, return the stored message until Kueue's message is read again.
    """
    if situation.seen.unasked:
        return why.message + UNASKED + (DESCRIBE_WORKLOAD if why.reason == Reason.QUEUED else DESCRIBE)
    before, plain = situation.old.message or "", why.message.removesuffix(AGAIN)
    waited = situation.old.reason == why.reason == Reason.QUEUED and before.startswith(f"{plain}: ")
    return before if waited and situation.seen.unadmitted is None else why.message


def trainer_has_ended(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended, but its pod has not."""
    pod = situation.seen.pod if situation.seen.job is not None else None
    if pod is None or pod.trainer is None or pod.trainer.exit is None:
        return None
    what = f"attempt {situation.counted.attempt} has ended; its simulators are being stopped"
    return Finding(explanation=explain(Reason.TRAINING, what=what), phase=Phase.RUNNING)


def trains(situation: ReplicaContext) -> Finding | None:
    """The trainer runs and has responded at least once."""
    if not runs(situation):
        return None
    if situation.seen.polled is not None and not situation.trains:
        return found(Reason.STARTING, what="its simulators are starting")
    return found(
        Reason.TRAINING,
        what=f"attempt {situation.counted.attempt} trains{unheeded(situation.job, situation.seen)}",
    )


def starts(situation: ReplicaContext) -> Finding | None:
    """The replica's objects are about to be created, or its containers start."""
    there = [*situation.seen.in_the_way, *([situation.pod.name] if situation.pod is not None else [])]
    if situation.seen.job is None:
        waits = f"waits for pod {there[0]} to end" if there else "is about to be created"
        return found(Reason.STARTING, what=waits)
    if situation.seen.pod is None:
        what = "its pod is about to be created"
    else:
        what = "its last pod has ended" if situation.seen.pod.ended else "its containers start"
        if situation.pod is not None and _in_trainer(situation.pod):
            what = "its trainer starts, and has not responded yet"
    return found(Reason.STARTING, what=what + (UNASKED + DESCRIBE if situation.seen.unasked else ""))


def runs(situation: ReplicaContext) -> bool:
    """Return whether the trainer runs, in a pod of the replica's Job, and has responded once.

    The kubelet reports the first response to the trainer's startup probe. A custom program has no startup
    probe, so a response to the operator's poll counts too.
    """
    pod = situation.pod if situation.seen.job is not None else None
    if pod is None or pod.trainer is None or not _in_trainer(pod):
        return False
    return pod.trainer.started or situation.seen.polled is not None


def _in_trainer(pod: PodView) -> bool:
    return pod.trainer is not None and pod.trainer.running_since is not None
