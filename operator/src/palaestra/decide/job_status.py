"""The status of the whole job: one phase, one reason, and the columns of `kubectl get`."""

from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason, say
from palaestra.api.status import TERMINAL, Phase, ReplicaStatus, Status
from palaestra.api.text import one_line
from palaestra.decide.conditions import Explanation
from palaestra.decide.replica_context import ReplicaVerdict
from palaestra.observe.models import Observed

LONGEST_NODES = 256  # characters of the names of all nodes
LONGEST_LEFT_OUT = 230  # of a line: a group's name, and 200 characters from a simulator


def standing(replicas: Sequence[ReplicaStatus]) -> ReplicaVerdict:
    """Return the phase of the job, and the reason."""
    phases = Counter(replica.phase for replica in replicas)
    if all(replica.phase in TERMINAL for replica in replicas):
        return _ended(replicas)
    if phases[Phase.RUNNING]:
        what = f"{phases[Phase.RUNNING]} of {len(replicas)} replicas train"
        return ReplicaVerdict(
            phase=Phase.RUNNING, explanation=Explanation(reason=Reason.TRAINING, message=what)
        )
    if phases[Phase.SUSPENDED] and not phases[Phase.PENDING]:
        return as_first(replicas, Phase.SUSPENDED)
    return as_first(replicas, Phase.PENDING)


def active(phase: Phase, replicas: Sequence[ReplicaStatus]) -> bool:
    """Return whether a job is active: it has not ended, and not all of its replicas are suspended."""
    suspended = all(replica.phase in TERMINAL | {Phase.SUSPENDED} for replica in replicas)
    return phase not in TERMINAL and not suspended


def started(old: Status, observed: Observed) -> datetime | None:
    """Return the start time of the job's first pod, by its node's clock."""
    if old.start_time is not None:
        return old.start_time
    begun = [pod for replica in observed.replicas for pod in replica.pods if pod.started is not None]
    first = min(begun, key=lambda pod: pod.created, default=None)
    return None if first is None else first.started


def columns(job: TrainingJob, replicas: Sequence[ReplicaStatus]) -> dict[str, Any]:
    """Return the columns of `kubectl get tj`; each has the value of the replica that is worst in it."""
    up = sum(replica.phase in {Phase.RUNNING, Phase.SUCCEEDED} for replica in replicas)
    steps = [replica.step for replica in replicas if replica.step is not None]
    saved = [replica.last_checkpoint.time for replica in replicas if replica.last_checkpoint is not None]
    nodes = [replica.node for replica in replicas if replica.node is not None]
    rates = [replica.success_rate for replica in replicas if replica.success_rate is not None]
    return {
        "running": f"{up}/{job.spec.replicas}",
        "step": min(steps, default=None),
        "success_rate": min(rates, default=None),
        "attempt": max((replica.attempt for replica in replicas), default=0) or None,
        "restarts": max((replica.restarts.trainer for replica in replicas), default=0) or None,
        "last_checkpoint_time": min(saved, default=None),
        "nodes": one_line(",".join(dict.fromkeys(nodes)), LONGEST_NODES) or None,
    }


def left_out(old: Status, observed: Observed) -> tuple[str, ...] | None:
    """Return the parts of the worlds that the simulators left out, by the last report; None without a report.

    All replicas have the same worlds and simulators, so one report is enough.
    """
    for replica in observed.replicas:
        if replica.polled is not None and replica.polled.status.left_out:
            lines = [one_line(line, LONGEST_LEFT_OUT) for line in replica.polled.status.left_out]
            return tuple(filter(None, lines)) or None
    return old.left_out


def _ended(replicas: Sequence[ReplicaStatus]) -> ReplicaVerdict:
    failed = [replica for replica in replicas if replica.phase is Phase.FAILED]
    if not failed:
        what = f"{len(replicas)} of {len(replicas)} replicas succeeded"
        return ReplicaVerdict(
            phase=Phase.SUCCEEDED, explanation=Explanation(reason=Reason.SUCCEEDED, message=what)
        )
    first = failed[0]
    explanation = Explanation(reason=Reason(first.reason or Reason.JOB_FAILED), message=first.message or "")
    if len(replicas) > 1:
        message = say(
            Reason.SOME_REPLICAS_FAILED,
            failed=len(failed),
            all=len(replicas),
            index=first.index,
            message=f"{first.reason}: {first.message}",
        )
        alike = len(failed) == len(replicas) and len({replica.reason for replica in failed}) == 1
        explanation = Explanation(
            reason=explanation.reason if alike else Reason.SOME_REPLICAS_FAILED, message=message
        )
    return ReplicaVerdict(phase=Phase.FAILED, explanation=explanation)


def as_first(replicas: Sequence[ReplicaStatus], phase: Phase) -> ReplicaVerdict:
    """Return the reason of the first replica in this phase."""
    first = next(replica for replica in replicas if replica.phase is phase)
    of = f"replica {first.index}: " if len(replicas) > 1 else ""
    explanation = Explanation(
        reason=Reason(first.reason or Reason.STARTING), message=f"{of}{first.message or ''}"
    )
    return ReplicaVerdict(phase=phase, explanation=explanation)
