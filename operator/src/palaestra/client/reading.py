"""What a job's status says, and whether it speaks of the job as it is."""

from palaestra.api import Status, TrainingJob
from palaestra.api.status import ConditionStatus


def current(job: TrainingJob) -> bool:
    """Return whether the status speaks of the newest spec."""
    return job.status.observed_generation == job.metadata.generation


def why(status: Status) -> str:
    """Return reason and message of the condition that says the phase; empty where none does."""
    for each in status.conditions:
        if status.phase and each.type.value == status.phase.value and each.status is ConditionStatus.TRUE:
            return f"{each.reason}: {each.message}"
    return ""
