"""A status is written at once where people wait for it, and every half minute where it only moves on."""

from copy import deepcopy
from datetime import UTC, datetime, timedelta

import pytest

from palaestra.decide import worth_writing

NOW = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)
OLD = {
    "phase": "Running",
    "step": 10,
    "conditions": [{"type": "Running", "status": "True"}],
    "replicas": [
        {
            "index": 0,
            "phase": "Running",
            "attempt": 1,
            "step": 10,
            "restarts": {"trainer": 0, "simulator": 0},
        }
    ],
}


def changed(change):
    """Return the status with a change of its first replica, or of the job."""
    new = deepcopy(OLD)
    (new["replicas"][0] if "phase" not in change else new).update(change)
    return new


def test_what_is_equal_is_not_written():
    """No request while nothing changes."""
    assert not worth_writing(OLD, deepcopy(OLD), None, NOW)


@pytest.mark.parametrize(
    "change",
    [
        {"step": 11},
        {"meanReturn": 1.0},
        {"stepsPerSecond": 20.5},
        {"restarts": {"trainer": 0, "simulator": 1}},
        {"goodput": {"stepping": 5}},
        {"faults": {"dead": 1}},
        {"stepsLost": 5},
        {"lastProgress": "2026-01-31T12:00:00Z"},
    ],
)
def test_progress_waits_for_half_a_minute(change):
    """Two hundred jobs with a write every ten seconds would be twenty a second."""
    new = changed(change)

    assert not worth_writing(OLD, new, NOW - timedelta(seconds=29), NOW)
    assert worth_writing(OLD, new, NOW - timedelta(seconds=30), NOW)
    assert worth_writing(OLD, new, None, NOW)


@pytest.mark.parametrize(
    "change",
    [
        {"phase": "Failed"},
        {"attempt": 2},
        {"reason": "ImagePull"},
        {"restarts": {"trainer": 1, "simulator": 0}},
        {"target": 100},
        {"successRate": 0.0},
        {"lastCheckpoint": {"step": 5, "time": "2026-01-31T12:00:00Z"}},
        {"lastAttempt": {"attempt": 1, "reason": "Disrupted"}},
        {"memoryKills": [{"container": "trainer", "times": 1}]},
    ],
)
def test_what_people_wait_for_is_written_at_once(change):
    """Phases, reasons, attempts, and the first numbers of a training."""
    assert worth_writing(OLD, changed(change), NOW, NOW)


@pytest.mark.parametrize(
    "old", [None, {}, "text", {"replicas": "none"}, {"replicas": ["none"]}, {"replicas": [{"index": 0}]}]
)
def test_whatever_the_api_server_holds_is_compared(old):
    """The first status, or one that somebody has written over."""
    assert worth_writing(old, OLD, NOW, NOW)
