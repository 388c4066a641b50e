"""The facade that a new environment uses."""

from __future__ import annotations

import gc
import os

import pytest

from palaestra_trainer.webots.facade_registry import give_back, offer, offered, take, withdraw


class Facade:
    """Any object that a program may create."""


@pytest.fixture
def make():
    """Make facades that are offered, and withdraw them at the end of the test."""
    made = []

    def one():
        made.append(Facade())
        offer(made[-1])
        return made[-1]

    yield one
    for facade in made:
        withdraw(facade)


def test_the_newest_facade_is_offered(make):
    """In a notebook, the cell above created it."""
    make()
    newest = make()

    assert offered() is newest


def test_a_facade_has_one_environment_at_a_time(make):
    """Two environments would move the same robot."""
    older, newest = make(), make()
    take(newest)

    assert offered() is older
    give_back(newest)
    assert offered() is newest


def test_a_facade_that_was_closed_is_offered_no_more(make):
    """This holds even if its environment gives it back later."""
    facade = make()
    take(facade)
    withdraw(facade)
    give_back(facade)

    assert offered() is None


def test_a_facade_that_nobody_has_is_forgotten():
    """The list must not keep a simulator's connections open."""
    facade = Facade()
    offer(facade)
    del facade
    gc.collect()

    assert offered() is None


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_is_offered_none_of_its_parent(make):
    """Both processes would read from the same connections."""
    facade = make()

    child = os.fork()
    if child == 0:
        os._exit(0 if offered() is None else 1)

    assert os.waitpid(child, 0)[1] == 0
    assert offered() is facade
