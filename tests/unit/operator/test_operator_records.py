"""The operator measures waits with its monotonic clock, and keeps them only while it leads."""

from datetime import UTC, datetime

import pytest

from palaestra.decide import Decision, ReconcileRecord
from palaestra.operator.controller import ReconcileRecords, now
from palaestra.operator.status_writer import StatusWriter

KEY = ("default", "job")
OLD = {"phase": "Running", "replicas": [{"index": 0, "phase": "Running", "step": 10}]}
WAITS = ReconcileRecord(waits={(0, "trainer", "uid"): 5.0})


class Notes:
    """A fake client and event recorder that keeps the patches."""

    def __init__(self):
        self.patches = []
        self.prunes = False

    def status(self, job, patch):
        """Keep a patch of the status and return the stored job, which is unchanged if `prunes` is set."""
        self.patches.append(patch)
        version = job["metadata"]["resourceVersion"] if self.prunes else str(len(self.patches) + 1)
        return {"metadata": {"resourceVersion": version}}


@pytest.fixture
def notes():
    """Return the fake client."""
    return Notes()


@pytest.fixture
def tell(notes, monkeypatch):
    """`tell(step=11, clock_s=30)` reports a step, and returns the seconds until the next write.

    None if it wrote.
    """
    reporting = StatusWriter(notes, None, lambda *_: None, lambda _, status: status)
    raw = {"metadata": {"namespace": "default", "name": "job", "resourceVersion": "1"}, "status": OLD}

    def tell(step, clock_s):
        new = {"phase": "Running", "replicas": [{"index": 0, "phase": "Running", "step": step}]}
        monkeypatch.setattr("palaestra.operator.status_writer.as_data", lambda _: new)
        return reporting.report(raw, Decision(status=object()), {}, clock_s).again_s

    return tell


def test_progress_is_held_back_by_the_monotonic_clock(tell, notes):
    """If somebody set a wall clock back by an hour, the operator would write no progress for an hour."""
    assert tell(11, 100.0) is None
    assert tell(12, 120.0) == 10
    assert tell(13, 130.0) is None
    assert [each["replicas"][0]["step"] for each in notes.patches] == [11, 13]


def test_a_status_that_the_api_server_prunes_is_sent_once(tell, notes):
    """An older definition makes the API server drop fields, so each reconcile would send them again."""
    notes.prunes = True

    assert [tell(11, clock_s) for clock_s in (100.0, 200.0, 300.0)] == [None, None, None]
    assert len(notes.patches) == 1


def test_a_job_that_is_made_again_begins_every_wait_anew():
    """The replicas of the new job have the same numbers as those of the earlier job."""
    records = ReconcileRecords()
    records.keep(KEY, "first", WAITS)

    assert records.of(KEY, "first") == WAITS
    assert records.of(KEY, "second") == ReconcileRecord()


def test_nothing_is_remembered_of_the_time_before_this_operator_led():
    """While another operator led, the awaited change may have happened and been undone."""
    records = ReconcileRecords()
    records.keep(KEY, "first", WAITS)

    records.clear()

    assert records.of(KEY, "first") == ReconcileRecord()


def test_the_clock_of_waits_is_not_the_wall():
    """Nobody can set the monotonic clock. Timestamps come from the wall clock and have a time zone."""
    times = now(WAITS)

    assert times.record == WAITS
    assert abs(now(WAITS).clock_s - times.clock_s) < 60
    assert (datetime.now(UTC) - times.now).total_seconds() < 60
