"""A failed reconcile is retried, and does not delay the reconciles of other keys."""

import threading

import pytest
import structlog.testing
from prometheus_client import CollectorRegistry, Histogram

from palaestra.api.reasons import Reason
from palaestra.cluster import Conflict, WorkQueue
from palaestra.cluster.timeouts import Backoff
from palaestra.decide import Replace, SetSuspend, Stop
from palaestra.decide.decision import Basis
from palaestra.operator.executor import Executor
from palaestra.operator.fenced_client import FencedClient, NotLeading
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import RejectedCreations
from palaestra.operator.workers import Workers

WAIT_S = 10.0
GOOD, BAD = ("robots", "good"), ("robots", "bad")
RAW = {"metadata": {"namespace": "robots", "name": "bad", "uid": "u", "resourceVersion": "7"}}
OF_REPLICA = {"job": "bad-0", "replica": 0, "basis": Basis(uid="job-uid", version="20")}
WHY = {"reason": Reason.STALLED, "message": "it"}
EVICTION = {"pod": "bad-0-x", "uid": "pod", "times": 1, **WHY}
MODIFIED = 'Operation cannot be fulfilled on jobs.batch "bad-0": the object has been modified'


class Desk:
    """One worker, a queue with short retries, and the worker's metrics."""

    def __init__(self, reconcile):
        self.queue = WorkQueue(again=Backoff(first_s=0.01, cap_s=0.01))
        self.gate = threading.Event()
        self.registry = CollectorRegistry()
        seconds = Histogram("seconds", "Time", ["result"], registry=self.registry)
        self.workers = Workers(self.queue, reconcile, gate=self.gate, seconds=seconds, count=1)
        self.workers.start()

    def counted(self, result):
        """Return the number of reconciles with this result."""
        return self.registry.get_sample_value("seconds_count", {"result": result}) or 0


@pytest.fixture
def desk():
    """Return a function that starts a desk, which ends with the test."""
    desks = []

    def begin(reconcile, *, opened=True):
        desks.append(Desk(reconcile))
        if opened:
            desks[-1].gate.set()
        return desks[-1]

    yield begin
    for each in desks:
        each.workers.stop(WAIT_S)


@pytest.mark.parametrize(
    ("trouble", "result"),
    [
        (ValueError("a mistake of ours"), "error"),
        (Conflict(409, "Conflict", "somebody else wrote"), "conflict"),
        (NotLeading("the Lease has passed on"), "conflict"),
    ],
)
def test_a_bad_key_delays_no_other(trouble, result, desk):
    """The only worker survives the error and takes the next key."""
    done = threading.Event()

    def reconcile(key):
        if key == BAD:
            raise trouble
        done.set()

    at_work = desk(reconcile)
    at_work.queue.add(BAD)
    at_work.queue.add(GOOD)

    assert done.wait(WAIT_S)
    assert at_work.workers.trouble() is None
    assert at_work.counted(result) >= 1


def test_a_key_that_failed_is_tried_again(desk):
    """The cause of the failure may be temporary."""
    tries = threading.Semaphore(0)

    def reconcile(key):
        del key
        tries.release()
        raise ValueError

    desk(reconcile).queue.add(BAD)

    assert all(tries.acquire(timeout=WAIT_S) for _ in range(3))


def test_a_key_is_looked_at_again_when_time_may_have_changed_something(desk):
    """A deadline passes without a change of any object, so no watch event causes a reconcile."""
    looks = threading.Semaphore(0)

    def reconcile(key):
        del key
        looks.release()
        return 0.01

    desk(reconcile).queue.add(GOOD)

    assert all(looks.acquire(timeout=WAIT_S) for _ in range(3))


def test_nothing_is_begun_while_another_leads(desk):
    """The key stays in the queue until this operator leads."""
    done = threading.Event()
    at_work = desk(lambda _: done.set(), opened=False)
    at_work.queue.add(GOOD)
    assert not done.is_set()

    at_work.gate.set()

    assert done.wait(WAIT_S)


def test_a_conflict_that_repeats_is_logged_and_ever_more_rarely(desk):
    """One conflict is harmless. A job that always fails must be logged, but must not fill the log."""
    tries = threading.Semaphore(0)

    def reconcile(key):
        del key
        tries.release()
        raise Outdated("pod job-0-x differs from the cache; nothing was created")

    with structlog.testing.capture_logs() as lines:
        at_work = desk(reconcile)
        at_work.queue.add(BAD)
        assert all(tries.acquire(timeout=WAIT_S) for _ in range(20))
        at_work.workers.stop(WAIT_S)

    assert [line["times"] for line in lines if line["event"] == "conflict repeats"][:3] == [4, 8, 16]
    assert "pod job-0-x" in lines[0]["error"]


class Refusing:
    """An API server in which another program always writes first."""

    def get(self, *_):
        """Return the TrainingJob in the version of the decision."""
        return RAW

    def list(self, *_, **__):
        """Return an empty list of pods."""
        return []

    def merge(self, *_, **__):
        """Refuse the patch."""
        raise Conflict(409, "Conflict", MODIFIED)

    evict = merge


@pytest.mark.parametrize(
    "action",
    [
        Stop(**OF_REPLICA, **WHY),
        SetSuspend(**OF_REPLICA, suspend=True),
        Replace(**OF_REPLICA, **EVICTION),
        Replace(**OF_REPLICA, **EVICTION, marked=True),
    ],
    ids=["stop", "suspend", "mark", "evict"],
)
def test_a_change_of_a_job_that_always_conflicts_is_logged_with_the_api_servers_words(action, desk):
    """Without the log line, a replica would train past its deadline and nobody would see the cause."""
    api = Refusing()
    acting = Executor(api, FencedClient(api, lambda: 1), None, RejectedCreations())
    tries = threading.Semaphore(0)

    def reconcile(_):
        tries.release()
        acting.carry_out(RAW, (action,))

    with structlog.testing.capture_logs() as lines:
        desk(reconcile).queue.add(BAD)
        assert all(tries.acquire(timeout=WAIT_S) for _ in range(10))

    repeated = [line for line in lines if line["event"] == "conflict repeats"]
    # The operator still retries the action.
    assert [(line["job"], line["times"]) for line in repeated[:2]] == [(BAD, 4), (BAD, 8)]
    assert MODIFIED in repeated[0]["error"]
