"""Several functions that run at the same time, each in its own thread."""

from __future__ import annotations

import threading

import pytest

from palaestra_trainer.run.signals import Interrupted
from palaestra_trainer.waiting.at_once import at_once
from palaestra_trainer.waiting.check import go_on

PATIENCE_S = 20.0


def test_the_results_are_in_the_order_of_the_works():
    """A caller assigns each result to its function by the order.

    Each function waits for the other, so both must run at the same time.
    """
    together = threading.Barrier(2, timeout=PATIENCE_S)

    def work(name):
        def run(check):
            check()
            together.wait()
            return name

        return run

    assert at_once([work("a"), work("b")], go_on, "test") == ["a", "b"]


def test_an_error_of_one_ends_the_others():
    """Nobody would read the results of the other functions, so they must not continue."""

    def broken(check):
        del check
        raise ValueError("broken")

    def endless(check):
        while True:
            check()

    with pytest.raises(ValueError, match="broken"):
        at_once([endless, broken], go_on, "test")


def test_the_callers_check_ends_all():
    """Only the main thread notices a signal."""

    def endless(check):
        while True:
            check()

    def interrupted():
        raise Interrupted("SIGTERM received")

    with pytest.raises(Interrupted):
        at_once([endless, endless], interrupted, "test")
