"""The reasons for which the replicas of a TrainingJob wait, from its status, for a metric."""

from palaestra.api.reasons import WAITING
from palaestra.api.status import Phase
from palaestra.objects import Object
from palaestra.observe.json_access import count, parts, text

_WORDS = frozenset(reason.value for reason in WAITING)


def waits(job: Object) -> tuple[str, ...]:
    """Return the reason of each replica that waits, or that runs but has not done a step yet."""
    return tuple(
        text(replica, "reason")
        for replica in parts(job, "status", "replicas")
        if text(replica, "reason") in _WORDS and _before_training(replica)
    )


def _before_training(replica: Object) -> bool:
    phase = text(replica, "phase")
    return phase == Phase.PENDING or (phase == Phase.RUNNING and count(replica, "step") == 0)
