"""The work queue holds each name once, gives it to only one worker at a time, and loses no name."""

import threading
import time

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from palaestra.cluster import WorkQueue
from palaestra.cluster.timeouts import Backoff

KEYS = st.sampled_from("abc")


class Workers(RuleBasedStateMachine):
    """Workers add, take, finish and retry keys in any order; a model of plain sets predicts the result."""

    def __init__(self):
        super().__init__()
        self.now = 0.0
        self.queue = WorkQueue(again=Backoff(first_s=2, cap_s=8, chance=lambda: 0.0), clock=lambda: self.now)
        self.working: set[str] = set()
        self.owed: set[str] = set()  # added, and not yet taken by a worker
        self.due: dict[str, float] = {}

    @rule(key=KEYS)
    def add(self, key):
        """Add a key at once."""
        self.queue.add(key)
        self.owed.add(key)

    @rule(key=KEYS, seconds=st.floats(min_value=0, max_value=20))
    def add_after(self, key, seconds):
        """Add a key after some seconds."""
        self.queue.add_after(key, seconds)
        self.due[key] = min(self.due.get(key, float("inf")), self.now + seconds)

    @rule(seconds=st.floats(min_value=0, max_value=10))
    def time_passes(self, seconds):
        """Advance the clock; the queue must then offer the keys that are due."""
        self.now += seconds

    @rule()
    def take(self):
        """Let a worker take a key."""
        self._fall_due()
        key = self.queue.get(0)

        if key is None:
            assert self.owed <= self.working, "a name was lost"
        else:
            assert key not in self.working, "two workers have one name"
            assert key in self.owed, "work that nobody asked for"
            self.working.add(key)
            self.owed.discard(key)

    @precondition(lambda self: self.working)
    @rule(data=st.data(), failed=st.booleans())
    def finish(self, data, failed):
        """Let a worker finish its key, or fail and retry it."""
        key = data.draw(st.sampled_from(sorted(self.working)))
        if failed:
            wait_s = self.queue.retry(key)
            self.due[key] = min(self.due.get(key, float("inf")), self.now + wait_s)
        else:
            self.queue.forget(key)
        self.queue.done(key)
        self.working.discard(key)

    @invariant()
    def the_depth_is_what_a_worker_could_take(self):
        """The metric counts waiting keys, without the keys that workers hold."""
        self._fall_due()
        assert self.queue.depth == len(self.owed - self.working)

    def _fall_due(self):
        for key in [key for key, due in self.due.items() if due <= self.now]:
            del self.due[key]
            self.owed.add(key)


Workers.TestCase.settings = settings(max_examples=60, stateful_step_count=40)
TestWorkers = Workers.TestCase


def test_names_are_handed_out_in_the_order_in_which_they_came():
    """A job that changes constantly must not delay other jobs."""
    queue = WorkQueue()
    for key in "abab":
        queue.add(key)

    assert [queue.get(0), queue.get(0), queue.get(0)] == ["a", "b", None]


def test_a_crowd_in_one_lane_delays_no_other_lane():
    """In each round every tenant gets one turn, even a tenant with a thousand jobs."""
    queue = WorkQueue(lane=lambda key: key[0])
    for key in ("a1", "a2", "a3", "b1", "b2", "c1"):
        queue.add(key)

    taken = [queue.get(0) for _ in range(6)]

    assert taken == ["a1", "b1", "c1", "a2", "b2", "a3"]
    assert (queue.depth, queue.get(0)) == (0, None)


def test_a_worker_that_waits_is_woken_by_work_that_falls_due():
    """A waiting worker must not have to poll the queue."""
    queue = WorkQueue()
    taken = []
    worker = threading.Thread(target=lambda: taken.append(queue.get(10)))
    worker.start()

    queue.add_after("a", 0.05)
    worker.join(5)

    assert taken == ["a"]


def test_closing_sends_every_worker_home_at_once():
    """The operator must stop within two seconds, however long its workers would wait."""
    queue = WorkQueue()
    workers = [threading.Thread(target=queue.get, args=(60,)) for _ in range(4)]
    for worker in workers:
        worker.start()
    started = time.monotonic()

    queue.close()
    for worker in workers:
        worker.join(5)

    assert time.monotonic() - started < 2
    assert queue.closed


def test_nothing_is_handed_out_after_closing():
    """The remaining work is not lost: the next leader reconciles every object."""
    queue = WorkQueue()
    queue.add("a")
    queue.close()

    assert queue.get(0) is None


def test_success_makes_the_next_failure_the_first():
    """A job that failed yesterday must not wait a minute after its first failure today."""
    queue = WorkQueue(again=Backoff(first_s=1, cap_s=60, chance=lambda: 0.0))
    assert [queue.retry("a"), queue.retry("a")] == [1, 2]

    queue.forget("a")

    assert queue.retry("a") == 1


def test_the_time_that_a_name_waited_is_reported():
    """The operator exports the latency of the queue as a metric."""
    now, waited = [0.0], []
    queue = WorkQueue(waited=waited.append, clock=lambda: now[0])
    queue.add("a")
    now[0] = 3.0

    queue.get(0)

    assert waited == [pytest.approx(3.0)]


def test_four_threads_do_every_change_and_never_one_name_together():
    """The state machine above uses one thread and cannot find a race, so this test uses four."""
    queue, busy, done, together = WorkQueue(), set(), [], []
    lock = threading.Lock()

    def work():
        while (key := queue.get(5)) is not None:
            with lock:
                together.extend([key] if key in busy else [])
                busy.add(key)
            with lock:
                busy.discard(key)
                done.append(key)
            queue.done(key)

    workers = [threading.Thread(target=work) for _ in range(4)]
    for worker in workers:
        worker.start()
    for number in range(400):
        queue.add(number % 7)
    ends = time.monotonic() + 10
    while queue.depth and time.monotonic() < ends:
        threading.Event().wait(0.01)
    queue.close()
    for worker in workers:
        worker.join(5)

    assert set(done) == set(range(7))
    assert not together
