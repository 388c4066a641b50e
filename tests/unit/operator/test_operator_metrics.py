"""The operator computes the metrics of its jobs from the statuses that it writes."""

import pytest

from palaestra.operator.metrics import Metrics

CREATED = "2026-01-31T12:00:00Z"


@pytest.fixture
def metrics():
    """Return the metrics of an operator that has just started."""
    return Metrics()


def job(**status):
    """Return a TrainingJob with this status, created at noon."""
    return {
        "metadata": {"name": "job", "namespace": "robots", "creationTimestamp": CREATED},
        "status": status,
    }


def replica(phase="Running", reason="Training", **restarts):
    """Return the status of the first replica."""
    counted = dict.fromkeys(("trainer", "simulator", "disruption", "suspension"), 0) | restarts
    return {"index": 0, "phase": phase, "reason": reason, "attempt": 1, "restarts": counted}


def status(*replicas, phase="Running", at="2026-01-31T12:01:30Z"):
    """Return the status of a job that has run since `at`."""
    running = {"type": "Running", "status": "True", "reason": "Training", "lastTransitionTime": at}
    return {"phase": phase, "conditions": [running], "replicas": list(replicas)}


def value(metrics, name, **labels):
    """Return the value of a sample; None if the sample does not exist."""
    return metrics.registry.get_sample_value(name, labels)


def test_a_job_is_timed_from_its_creation_until_it_first_runs(metrics):
    """The time counts once, however often the operator writes the status afterwards."""
    metrics.written(job(phase="Pending", replicas=[replica("Pending")]), status(replica()))
    metrics.written(job(**status(replica())), status(replica() | {"step": 7}))

    assert value(metrics, "palaestra_job_time_to_running_seconds_count") == 1
    assert value(metrics, "palaestra_job_time_to_running_seconds_sum") == 90
    assert value(metrics, "palaestra_job_time_to_running_seconds_bucket", le="60.0") == 0
    assert value(metrics, "palaestra_job_time_to_running_seconds_bucket", le="120.0") == 1


@pytest.mark.parametrize("trace", [{"attempt": 2}, {"target": 5000}], ids=["a second pod", "it was polled"])
def test_a_job_that_runs_again_is_not_timed_again(metrics, trace):
    """A job also starts to run after a pod was replaced, long after its creation."""
    before = job(phase="Pending", replicas=[replica("Pending") | trace])
    metrics.written(before, status(replica() | trace))

    assert value(metrics, "palaestra_job_time_to_running_seconds_count") == 0


def test_restarts_are_counted_by_cause_when_they_are_written(metrics):
    """The status has a total, so only the difference to the old status counts."""
    before = job(**status(replica(trainer=1, simulator=5)))
    metrics.written(before, status(replica(trainer=2, simulator=5, disruption=1)))

    counted = {
        cause: value(metrics, "palaestra_replica_restarts_total", cause=cause)
        for cause in ("trainer", "simulator", "disruption", "suspension")
    }
    assert counted == {"trainer": 1, "simulator": 0, "disruption": 1, "suspension": 0}


def test_a_replica_ends_once_and_for_its_reason(metrics):
    """The counter starts at 0, so that an alert on Diverged fires at the first case."""
    before = value(metrics, "palaestra_replica_ends_total", reason="Diverged")
    ended = status(replica("Failed", "Diverged"), phase="Failed")
    metrics.written(job(**status(replica())), ended)
    metrics.written(job(**ended), ended)

    assert before == 0
    assert value(metrics, "palaestra_replica_ends_total", reason="Diverged") == 1


def test_a_success_is_an_end_too(metrics):
    """Users query the share of successes among all ends."""
    metrics.written(job(), status(replica("Succeeded", "Succeeded"), phase="Succeeded"))

    assert value(metrics, "palaestra_replica_ends_total", reason="Succeeded") == 1


def test_an_end_for_a_reason_that_ends_nothing_is_counted_as_unknown(metrics):
    """The annotation of a stopped Job may name any reason, but the label must have few values."""
    metrics.written(job(), status(replica("Failed", "Queued"), phase="Failed"))

    assert value(metrics, "palaestra_replica_ends_total", reason="JobFailed") == 1
    assert value(metrics, "palaestra_replica_ends_total", reason="Queued") is None


def test_a_job_that_was_refused_has_no_replicas_to_count(metrics):
    """The status of a refused job has no replicas, and must not cause an error."""
    metrics.written(job(), {"phase": "Failed"})

    assert value(metrics, "palaestra_job_time_to_running_seconds_count") == 0


@pytest.mark.parametrize(("leads", "jobs"), [(True, 2), (False, None)])
def test_only_the_operator_that_leads_exports_jobs(metrics, leads, jobs):
    """A sum over all operators must count each job only once."""
    phases = [("robots", "Running"), ("robots", "Running")]
    metrics.watch(
        depth=lambda: 0, leads=lambda: leads, phases=lambda: phases, waits=list, outdated=lambda: None
    )

    assert value(metrics, "palaestra_jobs", job_namespace="robots", phase="Running") == jobs
    assert value(metrics, "palaestra_operator_leader") == leads


@pytest.mark.parametrize(("outdated", "shown"), [(True, 1), (False, 0), (None, None)])
def test_an_outdated_definition_is_a_gauge_that_has_no_value_before_it_was_read(metrics, outdated, shown):
    """A restart of the operator must not clear the alert before the definition is read."""
    metrics.watch(depth=lambda: 0, leads=lambda: True, phases=list, waits=list, outdated=lambda: outdated)

    assert value(metrics, "palaestra_operator_crd_outdated") == shown


@pytest.mark.parametrize(("leads", "replicas"), [(True, 2), (False, None)])
def test_replicas_that_wait_are_counted_by_what_they_wait_for(metrics, leads, replicas):
    """An alert on this metric reports, for example, a typo in an image that holds quota."""
    waiting = [("robots", "ImagePull"), ("robots", "ImagePull"), ("home", "Unschedulable")]
    metrics.watch(
        depth=lambda: 0, leads=lambda: leads, phases=list, waits=lambda: waiting, outdated=lambda: None
    )

    shown = value(metrics, "palaestra_replicas_waiting", job_namespace="robots", reason="ImagePull")
    assert shown == replicas
