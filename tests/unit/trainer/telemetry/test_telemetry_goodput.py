"""What the wall clock was spent on."""

from __future__ import annotations

import threading
from contextlib import ExitStack, suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.pod.status import Cause
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.telemetry.goodput import GoodputLedger, trained_share
from palaestra_trainer.telemetry.progress import Progress
from palaestra_trainer.waiting.wait_time import count_wait, waited_s


class Clock:
    """A clock that is set by hand, and a thread that waits for as long as a test asks it to."""

    def __init__(self):
        self.now = 1000
        self.waited = 50

    def pass_(self, seconds, waiting=0):
        """Let seconds pass, in the last of which the thread waits for simulators."""
        self.now += seconds
        self.waited += waiting

    def ledger(self):
        """Open a ledger."""
        return GoodputLedger(lambda: self.now, lambda: self.waited)


@pytest.fixture
def clock():
    """Return a clock."""
    return Clock()


@pytest.fixture
def goodput(clock):
    """Return a ledger that was just opened."""
    return clock.ledger()


def spent(goodput):
    """Return what something was spent on."""
    return {cause: seconds for cause, seconds in goodput.seconds().items() if seconds}


def test_a_run_starts_until_something_else_is_said(goodput, clock):
    """Nothing of the wall clock is lost before the first step."""
    clock.pass_(3)

    assert spent(goodput) == {"starting": 3}


def test_of_two_causes_the_inner_one_counts(goodput, clock):
    """An evaluation within training is no training."""
    with goodput.spending(Cause.LEARNING):
        clock.pass_(1)
        with goodput.spending(Cause.EVALUATING):
            clock.pass_(10)
        clock.pass_(2)
    clock.pass_(4)

    assert spent(goodput) == {"learning": 3, "evaluating": 10, "starting": 4}


def test_an_error_ends_a_cause_as_anything_does(goodput, clock):
    """An interrupted evaluation is followed by a checkpoint."""
    with suppress(KeyError), goodput.spending(Cause.EVALUATING):
        clock.pass_(5)
        raise KeyError
    clock.pass_(1)

    assert spent(goodput) == {"evaluating": 5, "starting": 1}


def test_what_a_step_waited_for_simulators_is_stepping_and_its_rest_transport(goodput, clock):
    """The one is the simulator's to mend, the other ours."""
    clock.pass_(7, waiting=6)
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(5, waiting=3)

    assert spent(goodput) == {"starting": 7, "stepping": 3, "transport": 2}


def test_a_wait_is_never_longer_than_its_step(goodput, clock):
    """Two clocks may differ in their last digits."""
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(5, waiting=6)

    assert spent(goodput) == {"stepping": 5}


def test_what_a_step_waited_for_a_simulator_that_hangs_is_no_step(goodput, clock):
    """It simulated nothing in that time."""
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(6, waiting=5)
        goodput.in_vain()
    with goodput.spending(Cause.TRANSPORT):
        clock.pass_(1, waiting=1)

    assert spent(goodput) == {"recovering": 5, "transport": 1, "stepping": 1}


def test_a_fault_that_is_noticed_beside_the_run_costs_it_nothing(goodput, clock):
    """Mending fails in a thread of its own."""
    with goodput.spending(Cause.TRANSPORT):
        thread = threading.Thread(target=goodput.in_vain)
        thread.start()
        thread.join()
        clock.pass_(2, waiting=2)

    assert spent(goodput) == {"stepping": 2}


def test_another_thread_spends_nothing(goodput, clock):
    """A simulator is mended beside a run that goes on."""

    def mend():
        with goodput.spending(Cause.RECOVERING):
            clock.pass_(5)

    with goodput.spending(Cause.LEARNING):
        thread = threading.Thread(target=mend)
        thread.start()
        thread.join()

    assert spent(goodput) == {"learning": 5}


def test_every_thread_may_ask(goodput, clock):
    """A scrape comes while the run does something."""
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
    """Let time pass, or spend what is inside on a cause, perhaps with an error at its end."""
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
    """However causes are nested and left: they add up to the wall clock, to the last digit."""
    clock = Clock()
    goodput, began = clock.ledger(), clock.now
    for move in course:
        play(goodput, clock, move)

        assert sum(goodput.seconds().values()) == clock.now - began


@given(st.lists(moves, max_size=6), st.lists(st.sampled_from(Cause), min_size=6, max_size=6))
def test_no_cause_shrinks_for_a_reader_amid_a_cause(course, causes):
    """Prometheus takes a counter that shrinks for a restart; only the step under way is missing."""
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
    """Whatever a run without faults, evaluations and checkpoints would do."""
    seconds = {"stepping": 30.0, "transport": 10.0, "learning": 20.0, "evaluating": 15.0, "starting": 5.0}

    assert trained_share(seconds) == 0.75


def test_of_no_time_no_share_trained():
    """It is not known, which is neither none nor all."""
    assert trained_share({}) is None
    assert trained_share({"learning": 0.0}) is None


def test_each_thread_has_waited_for_itself():
    """Evaluations wait in threads of their own."""
    before, others = waited_s(), []
    count_wait(1.5)
    thread = threading.Thread(target=lambda: others.append(waited_s()))
    thread.start()
    thread.join()

    assert (waited_s() - before, others) == (1.5, [0.0])


@pytest.fixture
def steps(clock, make_member):
    """Step one held member three times; return what that was spent on. It is let go after five seconds."""

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
    """As in an environment that computes by itself."""
    assert steps() == {"transport": 3}


def test_waiting_for_the_only_simulator_to_come_back_is_recovering(steps):
    """One step broke, one had only invalid rows, one was taken."""
    assert steps(steps=[1]) == {"transport": 2, "recovering": 5}


def test_waiting_for_a_simulator_that_is_recycled_is_recycling_and_not_recovering(steps):
    """Amid a step, between two episodes; a run without a fault does not look as if it had some."""
    assert steps(recycle_after=1) == {"transport": 3, "recycling": 5}
