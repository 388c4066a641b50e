"""One replica: its new status and the actions for it, from its old status and the observation."""

from dataclasses import dataclass, field

from palaestra.api.status import TERMINAL, ReplicaStatus
from palaestra.api.text import one_line
from palaestra.decide.last_attempt import last_attempt
from palaestra.decide.oom_kills import memory_kills
from palaestra.decide.progress import progress
from palaestra.decide.replica_context import ReplicaContext, ReplicaVerdict
from palaestra.decide.replica_policy import ReplicaActions, judge

LONGEST_NODE = 253  # characters of a node's name, as the API server bounds it


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """The status of a replica, and the actions for it."""

    status: ReplicaStatus
    course: ReplicaActions = field(default_factory=ReplicaActions)


def decided(situation: ReplicaContext) -> Decided:
    """Return the status and actions of a replica that had not ended."""
    verdict, course = judge(situation)
    return Decided(status=_status(situation, verdict), course=course)


def _status(situation: ReplicaContext, verdict: ReplicaVerdict) -> ReplicaStatus:
    old, reason = situation.old, verdict.explanation.reason.value
    changed = (old.phase, old.reason) != (verdict.phase, reason) or old.since is None
    counts = situation.counted
    return old.model_copy(
        update={
            "phase": verdict.phase,
            "reason": reason,
            "message": verdict.explanation.message,
            "since": situation.now if changed else old.since,
            "attempt": counts.attempt,
            "pod": counts.pod,
            "node": _node(situation),
            "restarts": counts.restarts,
            "simulator_restarts": counts.simulator_restarts,
            "furthest_step": counts.furthest_step,
            "fruitless": counts.fruitless,
            "last_attempt": last_attempt(situation, verdict if verdict.phase in TERMINAL else None),
            "memory_kills": memory_kills(situation),
            **progress(situation, verdict.phase),
        }
    )


def _node(situation: ReplicaContext) -> str | None:
    """Return the node of the newest pod; after the pod is gone, its last node."""
    pod = situation.seen.pod
    return situation.old.node if pod is None else one_line(pod.node, LONGEST_NODE) or None
