"""Several tasks take turns in one thread: while one waits, another continues."""

from __future__ import annotations

import gc
import socket
import threading
import time
import weakref
from contextlib import ExitStack
from functools import partial

import pytest
from greenlet import getcurrent
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.waiting import shutdown_deadline
from palaestra_trainer.waiting.greenlets import OpenWorks, away_s, let_others, take_turns
from palaestra_trainer.waiting.wait_time import waited_s


@pytest.fixture
def connections():
    """Yield two connections, each as a pair of a requesting and a responding end."""
    with ExitStack() as stack:
        yield [[stack.enter_context(end) for end in socket.socketpair()] for _ in range(2)]


@given(st.lists(st.integers(0, 4), max_size=5))
def test_results_come_in_the_order_of_the_works(pauses):
    """The order does not depend on how often a task lets the others run."""

    def work(place):
        for _ in range(pauses[place]):
            let_others()
        return place

    assert take_turns(lambda place=place: work(place) for place in range(len(pauses))) == [
        *range(len(pauses))
    ]


@given(st.lists(st.integers(1, 4), min_size=2, max_size=5))
def test_everyone_has_a_first_turn_before_anyone_has_a_second(pauses):
    """All requests are sent before the first wait, and responses are read in the order of the requests."""
    turns = []

    def work(place):
        for number in range(pauses[place]):
            turns.append((number, place))
            let_others()

    take_turns(lambda place=place: work(place) for place in range(len(pauses)))

    assert turns == sorted(turns)


def test_alone_there_is_nobody_to_let():
    """A notebook with one environment has no other task to run."""
    assert let_others() is None


def test_a_single_work_runs_in_the_greenlet_of_its_caller():
    """A run with one simulator needs no greenlet, whose switches copy its stack at every wait."""

    def work():
        let_others()
        return getcurrent(), away_s()

    assert take_turns([work]) == [(getcurrent(), 0.0)]


def test_a_single_work_within_a_turn_is_not_interrupted_by_other_tasks():
    """The outer task is between a request and its response while it serves its own simulators."""
    told = []

    def inner(name):
        told.append(f"{name} asks")
        let_others()
        told.append(f"{name} reads")

    take_turns([lambda: take_turns([lambda: inner("a")]), lambda: take_turns([lambda: inner("b")])])

    assert told == ["a asks", "a reads", "b asks", "b reads"]


def test_turns_may_be_taken_within_a_turn():
    """A task with several simulators of its own still counts as one task."""

    def pair(name):
        return take_turns([lambda: [name, let_others()][0], name.upper])

    assert take_turns([lambda: pair("a"), lambda: pair("b")]) == [["a", "A"], ["b", "B"]]


def test_an_error_waits_for_the_others():
    """If the error came at once, a simulator would be left between a request and its response."""
    done = []

    def fail():
        let_others()
        raise LookupError("mine")

    def succeed():
        let_others()
        let_others()
        done.append("second")

    with pytest.raises(LookupError, match="mine"):
        take_turns([fail, succeed])
    assert done == ["second"]


def test_an_interruption_ends_the_others_where_they_stand():
    """After Ctrl-C, no task continues. Each runs its `finally` blocks, for example to close a connection."""
    told = []

    def wait():
        try:
            let_others()
            told.append("went on")
        finally:
            told.append("cleaned up")

    def interrupt():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        take_turns([wait, interrupt, wait])
    assert told == ["cleaned up"]


def test_a_work_with_an_answer_goes_before_those_without(connections):
    """A slow simulator must delay only its own task."""
    (slow, answers_slowly), (quick, answers_quickly) = connections
    told = []

    def wait_long():
        let_others(until=slow)
        told.append("slow")

    def wait_briefly():
        answers_quickly.send(b"here")
        let_others(until=quick)
        told.append("quick")
        answers_slowly.send(b"here")

    take_turns([wait_long, wait_briefly])

    assert told == ["quick", "slow"]


def test_of_several_answers_the_first_that_was_asked_for_is_read_first(connections):
    """With several responses to read, the order must not depend on chance."""
    told = []

    def work(place):
        let_others(until=connections[place][0])
        told.append(place)

    for _, answers in connections:
        answers.send(b"here")
    take_turns([lambda: work(0), lambda: work(1)])

    assert told == [0, 1]


def test_an_answer_that_stays_away_is_left_to_the_work_that_asked_first(connections):
    """Only this task has the deadline, and knows what a missing response means."""
    told = []

    def work(place):
        let_others(until=connections[place][0])
        told.append(place)
        connections[1][1].send(b"here")

    take_turns([lambda: work(0), lambda: work(1)])

    assert told == [0, 1]


def test_a_wait_of_all_is_nobody_s_turn(connections):
    """The time counts as a wait for simulators, and as a part of each waiting task's step."""
    began, waited = time.perf_counter(), waited_s()
    found = []

    def work(place):
        let_others(until=connections[place][0])
        found.append(time.perf_counter() - began - away_s())

    answer = threading.Timer(0.01, lambda: [answers.send(b"here") for _, answers in connections])
    answer.start()
    take_turns([lambda: work(0), lambda: work(1)])
    answer.join()

    assert min(found) >= waited_s() - waited > 0


def test_the_slow_wait_beside_each_other_too(connections):
    """Both tasks wait in the same 50 ms, so each step takes 50 ms, whatever the order of the requests."""
    began, waited = time.perf_counter(), waited_s()
    found = []

    def work(place):
        asks, _ = connections[place]
        let_others(until=asks)
        asks.recv(100)
        found.append(time.perf_counter() - began - away_s())

    answer = threading.Timer(0.05, lambda: [answers.send(b"here") for _, answers in connections])
    answer.start()
    take_turns([lambda: work(0), lambda: work(1)])
    answer.join()

    assert min(found) >= waited_s() - waited > 0


def test_when_patience_is_over_nobody_is_waited_for(connections):
    """At the end of a run, sixteen simulators that hang must not each be waited for."""
    waited = waited_s()
    shutdown_deadline.end(after_s=-1.0)
    try:
        take_turns([partial(let_others, until=asks) for asks, _ in connections])
    finally:
        shutdown_deadline.renew()

    assert waited_s() - waited < 0.4


def test_of_several_errors_the_first_work_s_is_raised(connections):
    """A repeated run must fail with the same error, whichever simulator responds first."""

    def fail(place):
        if place == 0:
            let_others(until=connections[0][0])
        raise LookupError(str(place))

    with pytest.raises(LookupError, match="0"):
        take_turns([lambda: fail(0), lambda: fail(1)])


def test_nothing_of_a_work_outlives_it():
    """Greenlets are reused. If they kept observations or tracebacks, the memory would fill up."""

    class Result:
        pass

    [seen] = [weakref.ref(result) for result in take_turns([Result])]

    gc.collect()
    assert seen() is None


def test_turns_can_be_taken_again_after_any_end():
    """A step that failed or was interrupted must not affect the next one."""

    def interrupt():
        let_others()
        raise KeyboardInterrupt

    def fail():
        let_others()
        raise LookupError

    for broken, error in ((interrupt, KeyboardInterrupt), (fail, LookupError)):
        with pytest.raises(error):
            take_turns([let_others, broken, let_others])
        assert take_turns([lambda: 1, let_others, lambda: 3]) == [1, None, 3]


def test_each_thread_takes_turns_of_its_own():
    """A greenlet runs only in the thread that made it. A script may step environments in another thread."""
    take_turns([let_others, let_others])
    found = []

    thread = threading.Thread(target=lambda: found.extend(take_turns([lambda: 1, lambda: 2])))
    thread.start()
    thread.join()

    assert found == [1, 2]


@given(st.lists(st.integers(0, 4), min_size=1, max_size=5))
def test_open_works_end_one_after_the_other(pauses):
    """Each result comes once, the first after at most as many turns as the shortest work has."""
    works = OpenWorks()
    for place, pause in enumerate(pauses):
        works.begin(place, partial(paused, pause, place))

    results = []
    while len(results) < len(pauses):
        works.run(lambda _: True)
        results += works.take().items()

    assert sorted(results) == [(place, place) for place in range(len(pauses))]
    assert pauses[results[0][0]] == min(pauses)


def paused(turns, result):
    """Let the others run a number of times, and return `result`."""
    for _ in range(turns):
        let_others()
    return result


def test_open_works_read_a_response_that_came_between_two_runs(connections):
    """The simulators compute while the algorithm learns."""
    works, [(client, server), _] = OpenWorks(), connections

    def ask():
        let_others(until=client)
        return client.recv(9)

    works.begin(0, ask)
    works.begin(1, partial(paused, 0, "fast"))
    works.run(lambda _: True)
    assert works.take() == {1: "fast"}
    server.send(b"slow")
    works.run(lambda _: True)

    assert works.take() == {0: b"slow"}


def test_aborted_works_end_where_they_are():
    """A work that continued later would use a closed connection."""
    works, ended = OpenWorks(), []

    def work():
        try:
            paused(2, None)
        finally:
            ended.append(True)

    works.begin(0, work)
    works.begin(1, partial(paused, 0, None))
    works.run(lambda _: True)
    works.abort()

    assert ended == [True]
    assert works.take() == {}
