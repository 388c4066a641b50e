"""The registry decides which facade a new environment uses."""

from __future__ import annotations

import gc
import os

import pytest

from palaestra_trainer.webots.facade import open_facades


class Facade:
    """An object in place of a facade; any class will do."""


@pytest.fixture
def make():
    """Yield a function that makes facades and offers them; they are withdrawn at the end."""
    made = []

    def one():
        made.append(Facade())
        open_facades.offer(made[-1])
        return made[-1]

    yield one
    for facade in made:
        open_facades.withdraw(facade)


def test_the_newest_facade_is_offered(make):
    """In a notebook, this is the facade that the previous cell created."""
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
    """An environment may give back a closed facade later, and the registry must not offer it again."""
    facade = make()
    open_facades.take(facade)
    open_facades.withdraw(facade)
    open_facades.give_back(facade)

    assert open_facades.offered() is None


def test_a_facade_that_nobody_has_is_forgotten():
    """The registry must not keep the connections to a simulator open."""
    facade = Facade()
    open_facades.offer(facade)
    del facade
    gc.collect()

    assert open_facades.offered() is None


@pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")
def test_a_forked_process_is_offered_none_of_its_parent(make):
    """Parent and child would read from the same connections."""
    facade = make()

    child = os.fork()
    if child == 0:
        os._exit(0 if open_facades.offered() is None else 1)

    assert os.waitpid(child, 0)[1] == 0
    assert open_facades.offered() is facade
