"""The operator's reports: progress of trainers, metrics and logs. All its requests are permitted."""

from dataclasses import replace
from datetime import UTC, datetime

import pytest

from palaestra_protocol.pod.status import CheckpointStatus, SimulatorStatus, TrainerStatus
from tests.integration.operator.installed import USER
from tests.metrics import complaints, documented, served
from tests.trainer_status import serving
from tests.waiting import eventually

WRITTEN_S = 60.0  # the operator polls every 10 s and writes every 30 s
STATUS = TrainerStatus(
    step=1200,
    target=5000,
    episodes=7,
    phase="collecting",
    success_rate=0.25,
    steps_per_second=31.5,
    simulators=(SimulatorStatus(name="collect-0", role="Collect", state="ready", restarts=2),),
    last_checkpoint=CheckpointStatus(step=1000, time="2026-01-31T12:00:00Z"),
    left_out=("collect: the stub simulates no Drone: 1 node left out (line 7)",),
)


@pytest.fixture
def trainer():
    """Serve /status as a trainer in a pod does, and yield the address."""
    with serving(lambda: replace(STATUS, last_progress=f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}")) as address:
        yield address


def test_the_numbers_of_a_trainer_come_into_the_status(place, start, trainer):
    """A user reads step and success in `kubectl get tj` while the job runs."""
    start()
    place.train()
    [pod] = place.pods()

    place.run(pod, trainer)
    replica = eventually(
        lambda: next((each for each in place.status().get("replicas", ()) if each.get("step")), None),
        WRITTEN_S,
    )

    assert (replica["step"], replica["target"], replica["successRate"]) == (1200, 5000, 0.25)
    assert replica["simulators"][0]["restarts"] == 2
    assert replica["lastCheckpoint"]["step"] == 1000
    assert place.status()["step"] == 1200
    assert place.status()["leftOut"] == list(STATUS.left_out)


def test_the_metrics_count_jobs_by_phase(place, start):
    """Names of jobs as labels would create a new series for each job."""
    operator = start()
    place.train()
    place.pods()

    # The metrics count a job after the operator has seen its own status, and a request after its response.
    # The pods may exist earlier.
    counted = {
        f'palaestra_jobs{{job_namespace="{place.name}",phase="Pending"}} 1.0',
        'palaestra_operator_requests_total{code="200",resource="jobs",verb="create"} 1.0',
    }
    assert eventually(lambda: counted <= set(operator.ask("/metrics").splitlines()))
    assert operator.ask("/readyz") == "ok\n"
    assert operator.ask("/healthz") == "ok\n"


def test_the_metrics_are_those_of_the_page(place, start):
    """A user relies on the page, so the operator must serve exactly its metric families, with their types."""
    operator = start()
    place.train()
    place.pods()

    text = operator.ask("/metrics")

    assert served(text) == documented("operator")
    assert complaints(text) == ""


def test_a_job_that_runs_and_ends_is_counted(place, start):
    """Users query the time until a job starts and the reason why it ended.

    The operator counts each start and each end once, when the status first shows it.
    """
    operator = start()
    place.train()
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    place.end(pod, code=81)
    place.until("Failed")

    def counted():
        text = operator.ask("/metrics")
        return 'palaestra_replica_ends_total{reason="Diverged"} 1.0' in text and text

    assert "palaestra_job_time_to_running_seconds_count 1.0" in eventually(counted)


def test_log_lines_are_constant_messages_with_fields(place, start):
    """A user searches the log with `grep applied`, and a log store counts messages by text."""
    operator = start()
    place.train()
    place.pods()

    kinds = ["NetworkPolicy", "ConfigMap", "PersistentVolumeClaim", "Job"]
    eventually(lambda: [each["kind"] for each in operator.said("applied")] == kinds)  # pods may exist earlier
    assert operator.said("applied")[0]["job"] == [place.name, "job"]


def test_nothing_that_the_operator_asks_for_is_forbidden(place, start, control_plane):
    """The roles of install.yaml must suffice.

    test_operator_rights.py checks that these roles grant nothing else.
    """
    operator = start()
    place.train()
    place.pods()
    operator.stop()

    asked = [
        event
        for event in control_plane.audit(place.name)
        if event["user"].get("username") == USER  # the log has no user for a request without credentials
        and event.get("objectRef", {}).get("namespace") == place.name
    ]
    assert asked
    refused = [each for each in asked if each.get("responseStatus", {}).get("code") == 403]
    assert not refused
