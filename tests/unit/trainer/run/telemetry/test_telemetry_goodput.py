"""The goodput ledger divides the duration of a run by causes."""

from __future__ import annotations

import threading
from contextlib import ExitStack, suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.run.telemetry.goodput import GoodputLedger, trained_share
from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.wait_time import count_wait, waited_s


class Clock:
    """A clock, and the time for which the thread has waited for simulators; a test sets both."""

    def __init__(self):
        self.now = 1000
        self.waited = 50

    def pass_(self, seconds, waiting=0):
        """Let seconds pass, of which the thread waits `waiting` for simulators."""
        self.now += seconds
        self.waited += waiting

    def ledger(self):
        """Return a new ledger with this clock."""
        return GoodputLedger(lambda: self.now, lambda: self.waited)


@pytest.fixture
def clock():
    """Return a clock."""
    return Clock()


@pytest.fixture
def goodput(clock):
    """Return a new ledger with the clock."""
    return clock.ledger()


def spent(goodput):
    """Return the seconds of a ledger by cause, without causes of 0 seconds."""
    return {cause: seconds for cause, seconds in goodput.seconds().items() if seconds}


def test_a_run_starts_until_something_else_is_said(goodput, clock):
    """The time before the first step must be counted too."""
    clock.pass_(3)

    assert spent(goodput) == {"starting": 3}


def test_of_two_causes_the_inner_one_counts(goodput, clock):
    """During an evaluation inside the training, nothing is learned."""
    with goodput.spending(Cause.LEARNING):
        clock.pass_(1)
        with goodput.spending(Cause.EVALUATING):
            clock.pass_(10)
        clock.pass_(2)
    clock.pass_(4)

    assert spent(goodput) == {"learning": 3, "evaluating": 10, "starting": 4}


def test_an_error_ends_a_cause_as_anything_does(goodput, clock):
    """After an interrupted evaluation, the time of the checkpoint must have its own cause."""
    with suppress(KeyError), goodput.spending(Cause.EVALUATING):
        clock.pass_(5)
        raise KeyError
    clock.pass_(1)

    assert spent(goodput) == {"evaluating": 5, "starting": 1}


def test_what_a_step_waited_for_simulators_is_stepping_and_its_rest_transport(goodput, clock):
    """Stepping is the time of the simulator, and transport that of Palaestra."""
    clock.pass_(7, waiting=6)
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(5, waiting=3)

    assert spent(goodput) == {"starting": 7, "stepping": 3, "transport": 2}


def test_a_wait_is_never_longer_than_its_step(goodput, clock):
    """The two clocks may differ by rounding."""
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(5, waiting=6)

    assert spent(goodput) == {"stepping": 5}


def test_what_a_step_waited_for_a_simulator_that_hangs_is_no_step(goodput, clock):
    """A simulator that hangs simulates nothing in this time."""
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(6, waiting=5)
        goodput.in_vain()
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(1, waiting=1)

    assert spent(goodput) == {"recovering": 5, "transport": 1, "stepping": 1}


def test_a_fault_that_is_noticed_beside_the_run_costs_it_nothing(goodput, clock):
    """The failed restart is in its own thread, while the run continues to step."""
    with goodput.spending(Cause.TRANSPORT):
        thread = threading.Thread(target=goodput.in_vain)
        thread.start()
        thread.join()
        clock.pass_(2, waiting=2)

    assert spent(goodput) == {"stepping": 2}


def test_another_thread_spends_nothing(goodput, clock):
    """A simulator is restarted in its own thread while the run learns."""

    def mend():
        with goodput.spending(Cause.RECOVERING):
            clock.pass_(5)

    with goodput.spending(Cause.LEARNING):
        thread = threading.Thread(target=mend)
        thread.start()
        thread.join()

    assert spent(goodput) == {"learning": 5}


def test_every_thread_may_ask(goodput, clock):
    """A scrape of the metrics may come at any time, in another thread."""
    answers = []
    with goodput.spending(Cause.CHECKPOINTING):
        clock.pass_(5)
        thread = threading.Thread(target=lambda: answers.append(spent(goodput)))
        thread.start()
        thread.join()

    assert answers == [{"checkpointing": 5}]


moves = st.recursive(
    st.tuples(st.just("pass"), st.integers(0, 10**6), st.integers(0, 10**6)),
    lambda inner: st.tuples(st.sampled_from(Cause), st.lists(inner, max_size=4), st.booleans()),
    max_leaves=20,
)


def play(goodput, clock, move):
    """Let time pass, or play inner moves with a cause; the moves may end by an error."""
    if move[0] == "pass":
        clock.pass_(move[1], move[2])
        return
    cause, inner, fails = move
    with suppress(KeyError), goodput.spending(cause):
        for each in inner:
            play(goodput, clock, each)
        if fails:
            raise KeyError


@given(st.lists(moves, max_size=6))
def test_every_second_belongs_to_exactly_one_cause(course):
    """A person adds the seconds of all causes, and the sum must be exactly the duration."""
    clock = Clock()
    goodput, began = clock.ledger(), clock.now
    for move in course:
        play(goodput, clock, move)

        assert sum(goodput.seconds().values()) == clock.now - began


@given(st.lists(moves, max_size=6), st.lists(st.sampled_from(Cause), min_size=6, max_size=6))
def test_no_cause_shrinks_for_a_reader_amid_a_cause(course, causes):
    """Prometheus takes a decreasing counter for a restart.

    Only the time of the current step may be missing.
    """
    clock = Clock()
    goodput, began = clock.ledger(), clock.now
    before = goodput.seconds()
    with ExitStack() as stack:
        for move, cause in zip(course, causes, strict=False):
            stack.enter_context(goodput.spending(cause))
            entered = clock.now
            play(goodput, clock, move)

            now = goodput.seconds()
            under_way = clock.now - entered if goodput.cause is Cause.TRANSPORT else 0
            assert clock.now - began - under_way <= sum(now.values()) <= clock.now - began
            assert all(now[each] >= before[each] for each in now)
            before = now


def test_the_share_that_trained_is_that_of_steps_and_learning():
    """Evaluations, checkpoints and faults do not train."""
    seconds = {"stepping": 30.0, "transport": 10.0, "learning": 20.0, "evaluating": 15.0, "starting": 5.0}

    assert trained_share(seconds) == 0.75


def test_of_no_time_no_share_trained():
    """Without any time the share is unknown, which is neither 0 nor 1."""
    assert trained_share({}) is None
    assert trained_share({"learning": 0.0}) is None


def test_each_thread_has_waited_for_itself():
    """Evaluations wait for their simulators in threads of their own."""
    before, others = waited_s(), []
    count_wait(1.5)
    thread = threading.Thread(target=lambda: others.append(waited_s()))
    thread.start()
    thread.join()

    assert (waited_s() - before, others) == (1.5, [0.0])


@pytest.fixture
def steps(clock, make_member):
    """Return a function that steps a held simulator three times and returns the seconds by cause.

    The simulator is released after five seconds.
    """

    def run(**breaks):
        member = make_member(held=True, **breaks)
        progress = Progress(100, [("collect-0", "Collect")], lambda: clock.now)

        def check():
            clock.pass_(5)
            member.release.set()

        env = SimulatorsVecEnv([Restarter(member, watcher=progress)], run_seed=1, check=check)
        take_step = member.take_step
        member.take_step = lambda: (clock.pass_(1), take_step())
        env.reset()
        for _ in range(3):
            env.step(np.array([1]))
        env.close()
        return {cause: it for cause, it in progress.counted().goodput.items() if it}

    return run


def test_a_vector_step_is_transport_where_no_wire_is_waited_for(steps):
    """Such an environment computes everything in the trainer's own process."""
    assert steps() == {"transport": 3}


def test_waiting_for_the_only_simulator_to_come_back_is_recovering(steps):
    """The first step breaks, the second has only invalid rows, and the third succeeds."""
    assert steps(steps=[1]) == {"transport": 2, "recovering": 5}


def test_waiting_for_a_simulator_that_is_recycled_is_recycling_and_not_recovering(steps):
    """The wait is within a step, between two episodes. A run without faults must not seem to have had one."""
    assert steps(recycle_after=1) == {"transport": 3, "recycling": 5}
