"""The loop: sockets and moments, and when it looks instead of sleeping."""

import os
import socket

import pytest

from palaestra_sim.ros.loop import Loop


@pytest.fixture
def loop():
    """A loop, closed when the test ends."""
    fresh = Loop()
    yield fresh
    fresh.close()


@pytest.fixture
def pair(loop):
    """Two ends of a connection; the loop answers whatever arrives at its own."""
    mine, theirs = socket.socketpair()
    loop.watch(mine, lambda: mine.send(mine.recv(100)))
    yield theirs
    loop.forget(mine)
    mine.close()
    theirs.close()


@pytest.fixture
def looks(monkeypatch):
    """Grows by one with each look that lets the others run."""
    seen = []
    monkeypatch.setattr(os, "sched_yield", lambda: seen.append(1))
    return seen


@pytest.fixture
def chatter(loop, pair):
    """`chatter(50)`: as many questions and answers, with short waits between."""

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
    """Run until the last of some moments; return the number of the moment that each came as."""
    came = []
    for delay_s in delays_s:
        loop.later(delay_s, lambda delay_s=delay_s: came.append(delay_s))
    loop.later(max(delays_s), loop.stop)
    loop.run()
    return came


def test_moments_come_in_their_order(loop):
    """Whatever the order they were set in."""
    assert run(loop, 0.003, 0.001, 0.0, 0.002) == [0.0, 0.001, 0.002, 0.003]


def test_what_arrives_is_answered_meanwhile(loop, chatter):
    """A moment holds nothing up."""
    said = chatter(3)

    run(loop, 0.05)

    assert said == [b"question"] * 3


def test_after_short_waits_it_looks_before_it_sleeps(loop, chatter, looks):
    """Being woken would take longer than what comes next."""

    def talk():  # again, where somebody else had the processor meanwhile: that wait was no short one
        if looks:
            loop.stop()
        else:
            chatter(50)
            loop.later(0.05, talk)

    talk()
    run(loop, 30.0)

    assert looks


def test_a_longer_wait_now_and_then_is_enough_not_to_look(loop, pair, looks):
    """Polling in vain takes processor time from the other simulators."""

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
    """The peers wait for the end of a step too; three milliseconds became three and a third."""
    chatter(50)

    run(loop, 0.003)

    assert not looks


def test_another_thread_may_post(loop):
    """The one thing that others may do."""
    loop.post(loop.stop)

    assert loop.run() is None
