"""The facade that a new environment uses."""

from __future__ import annotations

import gc
import os

import pytest

from palaestra_trainer.webots.facade import open_facades


class Facade:
    """Any object that a program may create."""


@pytest.fixture
def make():
    """Make facades that are offered, and withdraw them at the end of the test."""
    made = []

    def one():
        made.append(Facade())
        open_facades.offer(made[-1])
        return made[-1]

    yield one
    for facade in made:
        open_facades.withdraw(facade)


def test_the_newest_facade_is_offered(make):
    """In a notebook, the cell above created it."""
    make()
    newest = make()

    assert open_facades.offered() is newest


def test_a_facade_has_one_environment_at_a_time(make):
    """Two environments would move the same robot."""
    older, newest = make(), make()
    open_facades.take(newest)

    assert open_facades.offered() is older
    open_facades.give_back(newest)
    assert open_facades.offered() is newest


def test_a_facade_that_was_closed_is_offered_no_more(make):
    """This holds even if its environment gives it back later."""
    facade = make()
    open_facades.take(facade)
    open_facades.withdraw(facade)
    open_facades.give_back(facade)

    assert open_facades.offered() is None


def test_a_facade_that_nobody_has_is_forgotten():
    """The list must not keep a simulator's connections open."""
    facade = Facade()
    open_facades.offer(facade)
    del facade
    gc.collect()

    assert open_facades.offered() is None


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_is_offered_none_of_its_parent(make):
    """Both processes would read from the same connections."""
    facade = make()

    child = os.fork()
    if child == 0:
        os._exit(0 if open_facades.offered() is None else 1)

    assert os.waitpid(child, 0)[1] == 0
    assert open_facades.offered() is facade
