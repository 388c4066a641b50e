"""Read a TrainingJob from the API server's JSON, or refuse it: invalid jobs must not delay other jobs."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from pydantic import ValidationError

from palaestra.api import TrainingJob, validate
from palaestra.api.reason_texts import say
from palaestra.api.reasons import Reason
from palaestra.api.status import Phase, Status
from palaestra.decide.actions import expired, expires
from palaestra.decide.clocks import first_of, seconds_to, whole
from palaestra.decide.decision import Decision
from palaestra.decide.events import emitted, of_actions, of_change
from palaestra.decide.explanation import Explanation
from palaestra.decide.job_status import ConditionState, condition_states, conditions, reconciliation
from palaestra.errors import SpecErrors, TrainingJobError
from palaestra.observe.json_access import count, part, text

# The value of `spec.managedBy` in jobs of this operator; the field may be absent.
MANAGER = "palaestra.dev/operator"


class JobRefused(TrainingJobError, ValueError):
    """The operator cannot run this TrainingJob, and a retry cannot help.

    Attributes:
        reason: the reason, as one word.
        message: the message for the status, as a sentence.
    """

    def __init__(self, reason: Reason, problem: str) -> None:
        super().__init__(problem)
        self.reason = reason
        self.message = say(reason, problem=problem)


def managed_here(raw: Mapping[str, Any]) -> bool:
    """Return whether this operator runs the job: it has no other controller, and is not being deleted."""
    manager = part(raw, "spec").get("managedBy")
    ours = manager is None or manager == MANAGER
    return ours and "deletionTimestamp" not in part(raw, "metadata")


def accept(raw: Mapping[str, Any]) -> TrainingJob:
    """Return the TrainingJob that `raw` describes, with its status.

    Raises:
        JobRefused: the spec breaks a rule that an API server cannot check, or the status is unreadable.
    """
    try:
        job = validate({name: value for name, value in raw.items() if name != "status"})
    except SpecErrors as error:
        raise JobRefused(Reason.INVALID_SPEC, "; ".join(error.problems)) from error
    return job.model_copy(update={"status": _status(raw)})


def reject(raw: Mapping[str, Any], refused: JobRefused, now: datetime) -> Decision:
    """Return the decision about a refused job.

    A job that was never accepted fails for good, because a spec does not change. A job that an older release
    accepted continues unchanged; this release does not change its pods or its status.
    """
    now = whole(now)
    explanation = Explanation(reason=refused.reason, message=refused.message)
    warning = emitted(refused.reason, refused.message)
    try:
        old = _status(raw)
    except JobRefused:
        return Decision(status=None, events=(warning,))
    if old.release is not None:
        return Decision(status=None, events=(warning,))
    status = _failed(raw, old, explanation, now)
    ttl_s = count(part(raw, "spec"), "ttlSecondsAfterFinished") if _has_ttl(raw) else None
    at, metadata = expires(status, ttl_s), part(raw, "metadata")
    actions = expired(text(metadata, "name", 253), text(metadata, "uid", 253), at, status, now)
    return Decision(
        status=status,
        actions=actions,
        events=(*of_change(old, status), *of_actions(actions)),
        wake_after_s=first_of([seconds_to(at, now)]),
    )


def _status(raw: Mapping[str, Any]) -> Status:
    try:
        return Status.model_validate(raw.get("status") or {}, by_alias=True, by_name=False)
    except ValidationError as error:
        raise JobRefused(
            Reason.STATUS_UNREADABLE, f"status: {error.error_count()} fields are wrong"
        ) from error


def _has_ttl(raw: Mapping[str, Any]) -> bool:
    return part(raw, "spec").get("ttlSecondsAfterFinished") is not None


def _failed(raw: Mapping[str, Any], old: Status, explanation: Explanation, now: datetime) -> Status:
    generation = count(part(raw, "metadata"), "generation") or None
    current = {
        **condition_states(ConditionState(holds=False, explanation=explanation), Phase.FAILED, explanation),
        **reconciliation(Phase.FAILED, explanation, suspend=False),
    }
    return old.model_copy(
        update={
            "phase": Phase.FAILED,
            "observed_generation": generation,
            "conditions": conditions(old, current, generation, now),
            "completion_time": old.completion_time or now,
        }
    )
