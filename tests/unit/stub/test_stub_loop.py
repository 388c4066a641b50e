"""The event loop of sockets and timers, and the times at which it polls instead of sleeping."""

import os
import socket

import pytest

from palaestra_sim.ros.loop import Loop


@pytest.fixture
def loop():
    """Yield a loop, which is closed at the end of the test."""
    fresh = Loop()
    yield fresh
    fresh.close()


@pytest.fixture
def pair(loop):
    """Yield one end of a connection; the loop returns all bytes that arrive at the other end."""
    mine, theirs = socket.socketpair()
    loop.watch(mine, lambda: mine.send(mine.recv(100)))
    yield theirs
    loop.forget(mine)
    mine.close()
    theirs.close()


@pytest.fixture
def looks(monkeypatch):
    """Return a list that grows by one at each poll."""
    seen = []
    monkeypatch.setattr(os, "sched_yield", lambda: seen.append(1))
    return seen


@pytest.fixture
def chatter(loop, pair):
    """`chatter(50)` exchanges 50 requests and responses, with short waits between them."""

    def begin(count):
        def go_on():
            said.append(pair.recv(100))
            if len(said) < count:
                pair.send(b"question")

        said = []
        loop.watch(pair, go_on)
        pair.send(b"question")
        return said

    yield begin
    loop.forget(pair)


def run(loop, *delays_s):
    """Run the loop until the last timer, and return the timers' delays in the order in which they fired."""
    came = []
    for delay_s in delays_s:
        loop.later(delay_s, lambda delay_s=delay_s: came.append(delay_s))
    loop.later(max(delays_s), loop.stop)
    loop.run()
    return came


def test_moments_come_in_their_order(loop):
    """The order in which the timers were set has no effect."""
    assert run(loop, 0.003, 0.001, 0.0, 0.002) == [0.0, 0.001, 0.002, 0.003]


def test_what_arrives_is_answered_meanwhile(loop, chatter):
    """While a timer is pending, the loop must still handle requests."""
    said = chatter(3)

    run(loop, 0.05)

    assert said == [b"question"] * 3


def test_after_short_waits_it_looks_before_it_sleeps(loop, chatter, looks):
    """After several short waits, the next request is near, and waking up takes longer than polling."""

    def talk():  # if another process took the processor, that wait was long; try again
        if looks:
            loop.stop()
        else:
            chatter(50)
            loop.later(0.05, talk)

    talk()
    run(loop, 30.0)

    assert looks


def test_a_longer_wait_now_and_then_is_enough_not_to_look(loop, pair, looks):
    """If no request comes soon, polling only takes processor time from other simulators."""

    def ask():
        asked.append(pair.send(b"question"))
        if len(asked) < 20:
            loop.later(0.012, ask)
        else:
            loop.stop()

    asked = []
    loop.watch(pair, lambda: pair.recv(100))
    ask()
    run(loop, 10.0)
    loop.forget(pair)

    assert len(asked) == 20
    assert not looks


def test_it_does_not_look_for_a_moment_that_is_near(loop, chatter, looks):
    """The clients also wait for the end of the step.

    With polling, three milliseconds became three and a third.
    """
    chatter(50)

    run(loop, 0.003)

    assert not looks


def test_another_thread_may_post(loop):
    """`post` is the only method that another thread may call."""
    loop.post(loop.stop)

    assert loop.run() is None
