"""A number names a plan, and the plans reach every request that they should."""

from hypothesis import given
from hypothesis import strategies as st

from tests.faults.plans import ROWS, Kind, plan, plans
from tests.faults.requests import WRITE, asked

JOBS = "/apis/batch/v1/namespaces/team/jobs"


@given(st.integers(0, 10_000))
def test_a_seed_names_the_same_plan_again(seed):
    """So that a failure can be repeated, and two seeds are never one plan."""
    workloads = ("ends", "pauses")

    assert plan(seed, workloads) == plan(seed, workloads)
    assert plan(seed, workloads).fault != plan(seed + len(workloads), workloads).fault


def test_every_write_of_every_workload_meets_every_fault_of_writes():
    """The claim of the soak, by counting."""
    counts = {"ends": {WRITE: 3}, "pauses": {WRITE: 5}}
    rows = [row for row in ROWS if row.request == WRITE]

    found = [(it.workload, it.fault.kind, it.fault.seconds, it.fault.number) for it in plans(counts)]

    assert sorted(found) == sorted(
        (workload, row.kind, row.seconds, number)
        for workload, count in (("ends", 3), ("pauses", 5))
        for row in rows
        for number in range(1, count + 1)
    )


def test_every_kind_of_fault_has_a_row():
    """A kind that no plan uses proves nothing."""
    assert {row.kind for row in ROWS} == set(Kind)


def test_requests_are_named_as_rbac_names_them():
    """A plan says which request it disturbs, and a report says which one it was."""
    patch = {"Content-Type": "application/merge-patch+json"}
    apply = {"Content-Type": "application/apply-patch+yaml"}
    status = "/apis/palaestra.dev/v1alpha1/namespaces/team/trainingjobs/job/status"

    assert asked("GET", f"{JOBS}?limit=25", {}).words == "list jobs"
    assert asked("GET", f"{JOBS}?watch=true", {}).words == "watch jobs"
    assert asked("GET", f"{JOBS}/job-0", {}).words == "get jobs job-0"
    assert asked("GET", "/api/v1/pods?labelSelector=x", {}).words == "list pods"
    assert asked("POST", JOBS, {}).words == "create jobs"
    assert asked("PATCH", status, patch).words == "patch trainingjobs/status job"
    assert asked("PATCH", f"{JOBS}/job-0", apply).words == "apply jobs job-0"
    assert asked("GET", "/version", {}).words == "get /version"
    assert asked("GET", "/apis/kueue.x-k8s.io/v1beta1", {}).verb == "get"


def test_requests_are_counted_by_kind():
    """Events and the Lease are no writes: losing one changes no job."""
    lease = "/apis/coordination.k8s.io/v1/namespaces/system/leases/operator"

    assert asked("POST", JOBS, {}).kind == "write"
    assert asked("POST", "/api/v1/namespaces/team/events", {}).kind == "event"
    assert asked("PUT", lease, {}).kind == "lease"
    assert asked("GET", f"{JOBS}?watch=true", {}).kind == "watch"
