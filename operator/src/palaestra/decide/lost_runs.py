"""Lost runs: a replica has trained, but its claim does not exist or its run directory is empty.

Such a replica would train from step 0 again. So the operator holds the replica and suspends its Job until a
person restores the run or gives it up. To give the run up, the person sets an annotation of the TrainingJob
to any new value, such as the time. The status stores the value that was applied last, so each value takes
effect only once.
"""

from collections.abc import Collection, Iterable
from datetime import datetime

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason
from palaestra.api.status import LostPart, LostRun, ReplicaStatus
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.restart_counts import counted
from palaestra.observe.models import ReplicaObserved
from palaestra.plan.claim import claim_name
from palaestra.plan.replica import RESTART_LOST_RUNS


def lost_runs(
    job: TrainingJob, replicas: Iterable[ReplicaObserved], present: Collection[tuple[str, str]]
) -> dict[int, LostRun]:
    """Return the lost runs that no person has given up yet, by replica; `present` has the existing claims."""
    before = {replica.index: replica for replica in job.status.replicas}
    found = {
        seen.index: _lost(job, before.get(seen.index, ReplicaStatus(index=seen.index)), seen, present)
        for seen in replicas
    }
    return {index: lost for index, lost in found.items() if lost is not None}


def why_lost(job: TrainingJob, index: int, lost: LostRun) -> Explanation:
    """Return the reason and message of a lost run."""
    claim = claim_name(job.metadata.name, index, job.metadata.uid or "")
    fact = f"the run directory is empty, although the run was at step {lost.step}"
    if lost.what is LostPart.CLAIM:
        fact = f"claim {claim} does not exist, although the run on it was at step {lost.step}"
    return explain(Reason.RUN_LOST, fact=fact, name=job.metadata.name)


def new_word(job: TrainingJob) -> str | None:
    """Return the value of the person's annotation if the operator has not applied it yet, else None."""
    word = job.metadata.annotations.get(RESTART_LOST_RUNS, "")[:256]
    return word if word and word != job.status.lost_runs_restarted else None


def restarted(replica: ReplicaStatus, lost: LostRun, now: datetime) -> ReplicaStatus:
    """Return the status of a replica whose lost run was given up or restored, without values of that run."""
    forgotten = (
        "step",
        "furthest_step",
        "last_checkpoint",
        "success_rate",
        "success_interval",
        "mean_return",
        "last_evaluation",
    )
    given_up = lost.model_copy(update={"restarted": now, "pod": replica.pod})
    return replica.model_copy(update={**dict.fromkeys(forgotten), "fruitless": 0, "lost": given_up})


def _lost(
    job: TrainingJob, old: ReplicaStatus, seen: ReplicaObserved, present: Collection[tuple[str, str]]
) -> LostRun | None:
    waiting = old.lost if old.lost is not None and old.lost.restarted is None else None
    if _lacks_claim(job, old, seen, present):
        return waiting or _record(LostPart.CLAIM, old, seen)
    if waiting is not None and waiting.what is LostPart.RUN_DIRECTORY:
        return waiting
    return _record(LostPart.RUN_DIRECTORY, old, seen) if _is_empty(job, old, seen) else None


def _lacks_claim(
    job: TrainingJob, old: ReplicaStatus, seen: ReplicaObserved, present: Collection[tuple[str, str]]
) -> bool:
    storage = job.spec.storage
    if storage.ephemeral or storage.existing_claim is not None or not counted(old, seen).furthest_step:
        return False
    name = claim_name(job.metadata.name, old.index, job.metadata.uid or "")
    return ("PersistentVolumeClaim", name) not in present


def _is_empty(job: TrainingJob, old: ReplicaStatus, seen: ReplicaObserved) -> bool:
    """Return whether a later attempt reports number 1, because it found no record of earlier attempts.

    The result is False for an ephemeral run, which is deleted with its pod. It is also False for a custom
    program that does not report the number of its attempt.
    """
    if seen.polled is None or old.last_checkpoint is None or job.spec.storage.ephemeral:
        return False
    begins = seen.polled.status.attempt == 1 and seen.polled.status.last_checkpoint is None
    return begins and counted(old, seen).attempt > 1


def _record(what: LostPart, old: ReplicaStatus, seen: ReplicaObserved) -> LostRun:
    saved = old.last_checkpoint.step if old.last_checkpoint is not None else 0
    counts = counted(old, seen)
    return LostRun(what=what, step=saved or counts.furthest_step or 0, pod=counts.pod)
