"""Turns: several works in one thread, each going on while the others wait."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.turns import let_others, take_turns


@given(st.lists(st.integers(0, 4), max_size=5))
def test_results_come_in_the_order_of_the_works(pauses):
    """However often each of them lets the others go first."""

    def work(place):
        for _ in range(pauses[place]):
            let_others()
        return place

    assert take_turns(lambda place=place: work(place) for place in range(len(pauses))) == [
        *range(len(pauses))
    ]


@given(st.lists(st.integers(1, 4), min_size=2, max_size=5))
def test_everyone_has_a_first_turn_before_anyone_has_a_second(pauses):
    """Whoever is asked first is read first, and all are asked before one is awaited."""
    turns = []

    def work(place):
        for number in range(pauses[place]):
            turns.append((number, place))
            let_others()

    take_turns(lambda place=place: work(place) for place in range(len(pauses)))

    assert turns == sorted(turns)


def test_alone_there_is_nobody_to_let():
    """A notebook steps one environment, and knows nothing of turns."""
    assert let_others() is None


def test_turns_may_be_taken_within_a_turn():
    """A work that has several simulators of its own is still one work."""

    def pair(name):
        return take_turns([lambda: [name, let_others()][0], name.upper])

    assert take_turns([lambda: pair("a"), lambda: pair("b")]) == [["a", "A"], ["b", "B"]]


def test_an_error_waits_for_the_others():
    """No simulator may be left between a request and its answer."""
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
    """Ctrl-C: each gets the chance to drop its connection, none goes on."""
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
