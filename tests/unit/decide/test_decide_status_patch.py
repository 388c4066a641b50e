"""The operator writes changes that people wait for at once, and progress every half minute."""

from copy import deepcopy

import pytest

from palaestra.api.status import ReplicaStatus, Status
from palaestra.decide import as_data, write_in_s

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
    """An unchanged status must cause no request to the API server."""
    assert write_in_s(OLD, deepcopy(OLD), None) is None


def test_an_empty_list_is_not_written():
    """For an empty list, `kubectl describe` would print a heading without content."""
    written = as_data(Status(replicas=(ReplicaStatus(index=0),)))

    assert [name for name, value in written["replicas"][0].items() if value == []] == []


def test_a_list_that_an_older_definition_adds_is_no_change():
    """An API server with an older definition adds empty lists.

    As a change, they would cause endless writes.
    """
    added = deepcopy(OLD)
    added["replicas"][0]["memoryKills"] = []

    assert write_in_s(added, OLD, 3600) is None


def test_active_time_is_written_with_what_else_changes():
    """Active time changes constantly, so on its own it would cause a write every half minute.

    Together with progress it causes no extra write.
    """
    active = {"activeSeconds": 30, "activeSince": "2026-01-31T12:00:30Z"}

    assert write_in_s(OLD, OLD | active, None) is None
    assert write_in_s(OLD, OLD | active, 3600) is None
    assert write_in_s(OLD, OLD | active | {"step": 11}, 3600) == 0


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
        {"phase": "Running", "leftOut": ["collect: no Drone: 1 node left out (line 7)"]},
    ],
)
def test_progress_waits_for_half_a_minute(change):
    """With a write every ten seconds, two hundred jobs would cause twenty writes a second."""
    new = changed(change)

    assert write_in_s(OLD, new, 29) == 1
    assert write_in_s(OLD, new, 30) == 0
    assert write_in_s(OLD, new, None) == 0


def test_evaluations_after_the_first_one_wait_too():
    """Some jobs evaluate every few seconds."""
    old = changed({"lastEvaluation": {"step": 5, "meanReturn": 1.0}})

    assert write_in_s(old, changed({"lastEvaluation": {"step": 10, "meanReturn": 2.0}}), 29) == 1


def queued(words):
    """Return the status of a job that waits in a queue, with Kueue's message."""
    told = {"reason": "Queued", "message": f"waits in queue trainings for Kueue: {words}"}
    conditions = [{"type": "Suspended", "status": "True", **told}]
    return {"phase": "Suspended", "conditions": conditions, "replicas": [{"index": 0, **told}]}


@pytest.mark.parametrize(
    ("words", "wait_s"),
    [
        ("cpu in flavor any-machine, 1.5 more needed", 25),
        ("memory in flavor any-machine, 25Mi more needed", 0),
    ],
)
def test_amounts_that_change_with_each_job_of_the_queue_are_written_as_progress(words, wait_s):
    """A newly missing resource is written at once. Its amount changes whenever another job comes or goes."""
    old = queued("cpu in flavor any-machine, 425m more needed")

    assert write_in_s(old, queued(words), 5) == wait_s


def test_a_number_in_another_message_is_news():
    """For example, the message counts the crashes of a sidecar, and a user must see each crash at once."""
    old = changed({"reason": "SidecarCrashLoop", "message": "crashed 3 times"})

    assert write_in_s(old, changed({"reason": "SidecarCrashLoop", "message": "crashed 4 times"}), 5) == 0


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
        {"lastEvaluation": {"step": 10, "meanReturn": 2.0}},
        {"lastAttempt": {"attempt": 1, "reason": "Disrupted"}},
        {"memoryKills": [{"container": "trainer", "times": 1}]},
    ],
)
def test_what_people_wait_for_is_written_at_once(change):
    """People wait for phases, reasons, attempts and the first values of a training."""
    assert write_in_s(OLD, changed(change), 0) == 0


@pytest.mark.parametrize(
    "old", [None, {}, "text", {"replicas": "none"}, {"replicas": ["none"]}, {"replicas": [{"index": 0}]}]
)
def test_whatever_the_api_server_holds_is_compared(old):
    """The old status may be absent, or another program may have overwritten it."""
    assert write_in_s(old, OLD, 0) == 0
