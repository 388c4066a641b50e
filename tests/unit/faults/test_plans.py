"""A seed identifies a plan, and the plans together disturb every request that they should."""

from collections import defaultdict

from hypothesis import given
from hypothesis import strategies as st

from tests.faults.plans import ROWS, Kind, plan, plans
from tests.faults.requests import WRITE, asked

LOST = {Kind.KILL_AFTER, Kind.DROP, Kind.DELAY}  # faults after the API server has executed the request
JOBS = "/apis/batch/v1/namespaces/team/jobs"


@given(st.integers(0, 10_000))
def test_a_seed_names_the_same_plan_again(seed):
    """A person can repeat a failure by its seed. Consecutive seeds of a workload give different faults."""
    workloads = ("ends", "pauses")

    assert plan(seed, workloads) == plan(seed, workloads)
    assert plan(seed, workloads).fault != plan(seed + len(workloads), workloads).fault


def test_every_write_of_every_workload_meets_a_fault_before_and_one_after_it_is_carried_out():
    """docs/explain/reliability.md promises two faults for each write, so the test counts the faults."""
    counts = {"ends": {WRITE: 7}, "pauses": {WRITE: 12}}
    met = defaultdict(list)
    for it in plans(counts):
        met[it.workload, it.fault.number].append(it.fault.kind in LOST)

    assert met.keys() == {
        (name, n) for name, count in (("ends", 7), ("pauses", 12)) for n in range(1, count + 1)
    }
    assert all(sorted(lost) == [False, True] for lost in met.values())


def test_writes_meet_every_fault_of_writes_in_turns():
    """Eight consecutive writes are enough to meet every fault of writes."""
    found = {(it.fault.kind, it.fault.seconds) for it in plans({"pauses": {WRITE: 8}})}

    assert found == {(row.kind, row.seconds) for row in ROWS if row.request == WRITE}


def test_every_kind_of_fault_has_a_row():
    """A plan draws only kinds that have a row in the table, so a kind without a row would never be tested."""
    assert {row.kind for row in ROWS} == set(Kind)


def test_requests_are_named_as_rbac_names_them():
    """Plans and reports use the same verbs and resources as RBAC rules."""
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
    """Events and Leases do not count as writes, because a lost one changes no job."""
    lease = "/apis/coordination.k8s.io/v1/namespaces/system/leases/operator"

    assert asked("POST", JOBS, {}).kind == "write"
    assert asked("POST", "/api/v1/namespaces/team/events", {}).kind == "event"
    assert asked("PUT", lease, {}).kind == "lease"
    assert asked("GET", f"{JOBS}?watch=true", {}).kind == "watch"
