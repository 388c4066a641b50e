"""The reason in a job's status, and whether the status is current."""

from palaestra.api import Status, TrainingJob
from palaestra.api.status import ConditionStatus


def current(job: TrainingJob) -> bool:
    """Return whether the status is about the newest spec."""
    return job.status.observed_generation == job.metadata.generation


def why(status: Status) -> str:
    """Return reason and message of the condition of the phase; empty if there is none."""
    for condition in status.conditions:
        if (
            status.phase
            and condition.type.value == status.phase.value
            and condition.status is ConditionStatus.TRUE
        ):
            return f"{condition.reason}: {condition.message}"
    return ""
