"""Build a TrainingJob in the middle of its run; a test sets the fields that differ."""

from copy import deepcopy
from datetime import UTC, datetime
from typing import Any

from palaestra.api import TrainingJob, validate
from tests.jobs import make_job

NOW = datetime(2026, 1, 31, 13, 0, tzinfo=UTC)
CREATED = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)

REPLICA: dict[str, Any] = {
    "index": 0,
    "phase": "Running",
    "reason": "Training",
    "message": "the trainer runs",
    "attempt": 2,
    "pod": {"name": "job-0-x7k2p", "uid": "u", "created": "2026-01-31T12:30:00Z"},
    "step": 12000,
    "target": 50000,
    "successRate": 0.4,
    "meanReturn": 3.25,
    "stepsPerSecond": 50.0,
    "simulators": [
        {
            "name": "collect-0",
            "role": "Collect",
            "state": "ready",
            "restarts": 3,
            "lastFault": "did not answer",
        },
        {"name": "evaluate-0", "role": "Evaluate", "state": "ready", "givenUp": True},
    ],
    "lastCheckpoint": {"step": 11000, "time": "2026-01-31T12:58:00Z"},
    "restarts": {"trainer": 1, "simulator": 3},
    "goodput": {"stepping": 75, "learning": 25},
    "lastAttempt": {
        "attempt": 1,
        "exitCode": 70,
        "reason": "TrainerFailed",
        "message": "exit code 70",
        "log": ["first", "last"],
    },
}


def running_job(
    *, name: str = "job", phase: str = "Running", spec: Any = None, **replica: Any
) -> TrainingJob:
    """Return a job with one replica; the keywords are fields of the replica's status."""
    condition = {
        "type": phase,
        "status": "True",
        "reason": "Because",
        "message": "so it is",
        "lastTransitionTime": "2026-01-31T12:59:00Z",
    }
    status = {
        "phase": phase,
        "observedGeneration": 1,
        "running": "1/1",
        "startTime": "2026-01-31T12:00:30Z",
        "conditions": [condition] if phase != "Pending" else [],
        "replicas": [deepcopy(REPLICA) | replica],
    }
    named = {"namespace": "lab", "uid": "0d1f", "generation": 1}
    return validate(make_job(name, metadata=named, status=status, **(spec or {})))
