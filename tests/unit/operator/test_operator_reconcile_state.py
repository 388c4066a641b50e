"""What the operator remembers of time: on its monotonic clock, and not longer than it leads."""

from datetime import UTC, datetime

import pytest

from palaestra.decide import Decision, ReconcileRecord
from palaestra.operator.controller import now
from palaestra.operator.reconcile_state import ReconcileRecords
from palaestra.operator.status_writer import StatusWriter

KEY = ("default", "job")
OLD = {"phase": "Running", "replicas": [{"index": 0, "phase": "Running", "step": 10}]}
WAITS = ReconcileRecord(waits={(0, "trainer", "uid"): 5.0})


class Notes:
    """A writer and a recorder that note what they are asked to write."""

    def __init__(self):
        self.patches = []
        self.prunes = False

    def status(self, job, patch):
        """Note the patch of a status, and return the job as stored: unchanged where all was pruned."""
        self.patches.append(patch)
        version = job["metadata"]["resourceVersion"] if self.prunes else str(len(self.patches) + 1)
        return {"metadata": {"resourceVersion": version}}


@pytest.fixture
def notes():
    """Return where the patches of statuses are noted."""
    return Notes()


@pytest.fixture
def tell(notes, monkeypatch):
    """`tell(step=11, clock_s=30)`: tell a step, and return the seconds until it is written."""
    reporting = StatusWriter(notes, None, lambda *_: None, lambda _, status: status)
    raw = {"metadata": {"namespace": "default", "name": "job", "resourceVersion": "1"}, "status": OLD}

    def tell(step, clock_s):
        new = {"phase": "Running", "replicas": [{"index": 0, "phase": "Running", "step": step}]}
        monkeypatch.setattr("palaestra.operator.status_writer.as_data", lambda _: new)
        return reporting.report(raw, Decision(status=object()), {}, clock_s).again_s

    return tell


def test_progress_is_held_back_by_the_monotonic_clock(tell, notes):
    """By a wall clock that is set back an hour there would be no progress for an hour."""
    assert tell(11, 100.0) is None
    assert tell(12, 120.0) == 10
    assert tell(13, 130.0) is None
    assert [each["replicas"][0]["step"] for each in notes.patches] == [11, 13]


def test_a_status_that_the_api_server_prunes_is_sent_once(tell, notes):
    """An older definition drops fields that it does not have: each look would send the same patch again."""
    notes.prunes = True

    assert [tell(11, clock_s) for clock_s in (100.0, 200.0, 300.0)] == [None, None, None]
    assert len(notes.patches) == 1


def test_a_job_that_is_made_again_begins_every_wait_anew():
    """Its replicas have the numbers of those before."""
    records = ReconcileRecords()
    records.keep(KEY, "first", WAITS)

    assert records.of(KEY, "first") == WAITS
    assert records.of(KEY, "second") == ReconcileRecord()


def test_nothing_is_remembered_of_the_time_before_this_operator_led():
    """An awaited change may have come and gone while another operator led."""
    records = ReconcileRecords()
    records.keep(KEY, "first", WAITS)

    records.clear()

    assert records.of(KEY, "first") == ReconcileRecord()


def test_the_clock_of_waits_is_not_the_wall():
    """Nobody can set it; a stamp has a time zone."""
    times = now(WAITS)

    assert times.record == WAITS
    assert abs(now(WAITS).clock_s - times.clock_s) < 60
    assert (datetime.now(UTC) - times.now).total_seconds() < 60
