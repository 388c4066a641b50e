"""One fault of each kind between operator and API server; each run must end as a run without a fault does.

`python -m tests.soak faults` causes faults at every write. It also runs the workloads in which the Job
controller waits 10 s or more before the next pod.
"""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.faults.plans import TRAINERS, Fault, Kind, Plan
from tests.faults.rig import Rig

# The time of the first test includes the runs without faults.
pytestmark = [pytest.mark.minutes(2), pytest.mark.timeout(600)]

AT_ONCE = 3  # runs mostly wait, so several can run at once
FAULTS = {
    Fault(kind=Kind.KILL_BEFORE, request="write", number=9): "again",
    Fault(kind=Kind.KILL_AFTER, request="write", number=10): "pauses",
    Fault(kind=Kind.DROP, request="write", number=8): "again",
    Fault(kind=Kind.CONFLICT, request="write", number=7): "pauses",
    Fault(kind=Kind.GONE, request="change", number=20): "again",
    Fault(kind=Kind.BUSY, request="write", number=6): "pauses",
    Fault(kind=Kind.ERROR, request="write", number=5): "again",
    Fault(kind=Kind.UNAVAILABLE, request="watch", number=4): "pauses",
    Fault(kind=Kind.CUT, request="change", number=15): "again",
    Fault(kind=Kind.FREEZE, request="change", number=25, seconds=3.0): "pauses",
    Fault(kind=Kind.DELAY, request="write", number=12, seconds=2.0): "again",
    Fault(kind=Kind.AWAY, request="write", number=14, seconds=3.0): "pauses",
}


@pytest.fixture(scope="module")
def runs(control_plane, installed):
    """Start all plans, several at a time, and yield the future result of each."""
    rig = Rig(control_plane, installed)
    with ThreadPoolExecutor(AT_ONCE) as pool:
        undisturbed = [pool.submit(rig.undisturbed, each) for each in sorted(set(FAULTS.values()))]
        assert [each.result() for each in undisturbed]
        yield {
            fault: pool.submit(rig.run, Plan(seed=0, workload=workload, fault=fault))
            for fault, workload in FAULTS.items()
        }


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.words)
def test_a_disturbed_operator_brings_every_job_to_the_same_end(fault, runs):
    """A fault must leave no trace.

    States and counters are the same, each replica has one pod, no orphan stays,
    and the operator stops sending requests.
    """
    run = runs[fault].result()

    assert run.met, "the fault never came"
    assert run.wrong == ()


def test_each_kind_of_fault_is_tried():
    """The faults of trainers take a minute each, so only `make soak` runs them."""
    assert {fault.kind for fault in FAULTS} == set(Kind) - TRAINERS
