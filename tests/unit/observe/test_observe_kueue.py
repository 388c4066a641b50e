"""The operator reads the reason of a wait from a Workload, in the format of Kueue 0.19."""

import pytest

from palaestra.observe import why_not_admitted
from palaestra.observe.json_access import MOST_TEXT
from palaestra.observe.kueue import NO_WORKLOAD

SHORT = "couldn't assign flavors to pod set main: insufficient unused quota for cpu in flavor any-machine"
UNREADABLE = [
    {"metadata": 1, "spec": "x"},
    {"status": {"conditions": "none"}},
    {"status": {"conditions": [{"type": "QuotaReserved", "status": "False", "message": 5}]}},
]


def condition(kind, status, message=""):
    """Return a condition of a Workload."""
    return {"type": kind, "status": status, "message": message}


def workload(*conditions, created="2026-01-31T12:00:00Z", active=True, checks=()):
    """Return a Workload with these conditions."""
    return {
        "metadata": {"name": "job-job-0-1a2b3", "creationTimestamp": created},
        "spec": {"active": active},
        "status": {"conditions": list(conditions), "admissionChecks": list(checks)},
    }


def test_what_a_job_waits_for_is_in_the_words_of_the_quota():
    """The author of a job may be able to read TrainingJobs, but not Workloads."""
    assert why_not_admitted([workload(condition("QuotaReserved", "False", SHORT))]) == SHORT


def test_long_words_are_bounded_and_on_one_line():
    """Kueue allows 32,768 characters in a message, but a status must stay small."""
    words = why_not_admitted([workload(condition("QuotaReserved", "False", "a\nb " * 9000))])

    assert len(words) == MOST_TEXT
    assert words.startswith("a b a b")


def test_the_message_for_a_job_without_a_workload_names_what_to_check():
    """Kueue creates no Workload for a Job that it does not manage."""
    assert why_not_admitted([]) == NO_WORKLOAD


def test_a_workload_that_somebody_deactivated_is_named_with_the_remedy():
    """The condition of such a Workload may still have an old message, which would mislead the user."""
    stopped = workload(condition("QuotaReserved", "False", SHORT), active=False)

    assert why_not_admitted([stopped]) == (
        "Workload job-job-0-1a2b3 is not active; set its spec.active to true"
    )


def test_checks_that_have_not_passed_are_named():
    """The quota is reserved, but the admission check of another controller may still refuse the job."""
    checks = [
        {"name": "budget", "state": "Ready", "message": "paid"},
        {"name": "machines", "state": "Pending", "message": "2 nodes are on order"},
        {"name": "approval", "state": "Retry", "message": ""},
    ]
    reserved = workload(condition("QuotaReserved", "True", "Quota reserved"), checks=checks)

    assert why_not_admitted([reserved]) == (
        "AdmissionCheck machines is Pending: 2 nodes are on order; AdmissionCheck approval is Retry"
    )


@pytest.mark.parametrize(
    "found",
    [
        workload(),
        workload(condition("QuotaReserved", "True", "Quota reserved"), condition("Admitted", "True")),
        *UNREADABLE,
    ],
    ids=["new", "admitted", "text", "list", "number"],
)
def test_nothing_is_said_of_a_workload_that_gives_no_reason(found):
    """Kueue has not written a reason yet, or another program has written unreadable content."""
    assert why_not_admitted([found]) == ""


def test_of_several_workloads_the_newest_counts():
    """When a Job changes, Kueue replaces its Workload."""
    old = workload(condition("QuotaReserved", "False", "old"))
    new = workload(condition("QuotaReserved", "False", "new"), created="2026-01-31T12:00:01Z")

    assert why_not_admitted([new, old]) == "new"
