"""The metric of replicas that wait, by the reason of the wait."""

import pytest

from palaestra.api.reason_texts import ROWS
from palaestra.api.reasons import WAITING
from palaestra.operator.caches import waits


def status(*replicas):
    """Return a TrainingJob whose status has these replicas."""
    return {"status": {"replicas": list(replicas)}}


def test_each_replica_that_waits_counts_with_its_reason():
    """The replicas of one job may wait for different reasons."""
    job = status(
        {"phase": "Pending", "reason": "ImagePull"},
        {"phase": "Pending", "reason": "Unschedulable"},
        {"phase": "Pending", "reason": "ImagePull", "step": 3_000_000},
        {"phase": "Running", "reason": "SimulatorStartDeadline", "step": 0},
    )

    assert waits(job) == ("ImagePull", "Unschedulable", "ImagePull", "SimulatorStartDeadline")


@pytest.mark.parametrize(
    "replica",
    [
        {"phase": "Running", "reason": "Training", "step": 7},
        {"phase": "Running", "reason": "SimulatorOutOfMemory", "step": 7},
        {"phase": "Failed", "reason": "ImagePull"},
        {"phase": "Suspended", "reason": "Queued"},
        {"phase": "Pending", "reason": "Starting"},
        {"phase": "Pending", "reason": ["ImagePull"]},
        {},
        "nonsense",
    ],
    ids=["trains", "mends", "ended", "queued", "starts", "list", "empty", "text"],
)
def test_no_other_replica_counts(replica):
    """A wait in a queue is normal, and a replica that trains or has ended does not wait."""
    assert waits(status(replica)) == ()


def test_a_job_without_a_status_has_no_replica_that_waits():
    """No operator has reconciled this job yet."""
    assert waits({}) == ()


def test_every_reason_to_wait_is_a_warning():
    """An alert counts these reasons, and its reader needs a remedy for each."""
    assert all(ROWS[reason].warning and ROWS[reason].remedy for reason in WAITING)
