"""One replica: from what its status said and what is seen to its status now, and what is done about it."""

from dataclasses import dataclass

from palaestra.api.status import TERMINAL, ReplicaStatus
from palaestra.decide.conditions import Told
from palaestra.decide.judging import judge
from palaestra.decide.memory import memory_kills
from palaestra.decide.progress import progress
from palaestra.decide.remembering import last_attempt
from palaestra.decide.situation import Situation, Verdict
from palaestra.decide.times import Trouble, Wait


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """What follows for a replica.

    Attributes:
        status: how it stands.
        stop: why to stop it; None: it goes on.
        replace: why to replace its pod; None: it stays.
        left_s: seconds after which time alone may change something.
        waits: what is waited for, to be remembered until the next look.
        trouble: what keeps it from its first step, to be remembered too; None: nothing that has a name.
    """

    status: ReplicaStatus
    stop: Told | None = None
    replace: Told | None = None
    left_s: tuple[float, ...] = ()
    waits: tuple[Wait, ...] = ()
    trouble: Trouble | None = None


def decided(it: Situation) -> Decided:
    """Return what follows for a replica that had not ended."""
    judged = judge(it)
    return Decided(
        status=_status(it, judged.verdict),
        stop=judged.stop,
        replace=judged.replace,
        left_s=judged.left_s,
        waits=judged.waits,
        trouble=judged.trouble,
    )


def _status(it: Situation, verdict: Verdict) -> ReplicaStatus:
    old, reason = it.old, verdict.told.reason.value
    changed = (old.phase, old.reason) != (verdict.phase, reason) or old.since is None
    counts = it.counted
    return old.model_copy(
        update={
            "phase": verdict.phase,
            "reason": reason,
            "message": verdict.told.message,
            "since": it.now if changed else old.since,
            "attempt": counts.attempt,
            "pod": counts.pod,
            "restarts": counts.restarts,
            "simulator_restarts": counts.simulator_restarts,
            "furthest_step": counts.furthest_step,
            "fruitless": counts.fruitless,
            "last_attempt": last_attempt(it, verdict if verdict.phase in TERMINAL else None),
            "memory_kills": memory_kills(it),
            **progress(it, verdict.phase),
        }
    )
