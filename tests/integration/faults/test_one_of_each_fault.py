"""One fault of each kind between operator and API server: every run comes to the same as an undisturbed one.

`python -m tests.soak faults` does so at every write. Workloads in which the Job controller pauses between
two pods, for 10 s and more, are left to it.
"""

from concurrent.futures import ThreadPoolExecutor

import pytest

from tests.faults.plans import TRAINERS, Fault, Kind, Plan
from tests.faults.rig import Rig

# The first test waits for the undisturbed runs, too.
pytestmark = [pytest.mark.minutes(2), pytest.mark.timeout(600)]

AT_ONCE = 3  # a run waits most of its time
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
    """What comes of each plan, once it has run; several run at a time."""
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
    """End state and counters, one pod a replica, no orphans, and silence at last."""
    run = runs[fault].result()

    assert run.met, "the fault never came"
    assert run.wrong == ()


def test_each_kind_of_fault_is_tried():
    """But for those of trainers, which take a minute each: the soak has them."""
    assert {fault.kind for fault in FAULTS} == set(Kind) - TRAINERS
