"""The life of a simulator: one table defines it, and the picture in the docstring shows the same."""

import re
from itertools import product

import pytest

from palaestra_protocol.control import SidecarState
from palaestra_sim.sidecar import lifecycle
from palaestra_sim.sidecar.lifecycle import TABLE, Action, LifecycleEvent

IDLE, STARTING, READY, STOPPING, FAILED = SidecarState
ARROW = re.compile(r"^ {4}(\w+) +--(\w+)--> +(\w+) +(\w+)$", re.MULTILINE)


def after(*events: LifecycleEvent, state: SidecarState = IDLE) -> SidecarState:
    """Return the state after some allowed events."""
    for event in events:
        step = lifecycle.step(state, event)
        assert step is not None, f"{event} in {state}"
        state = step[0]
    return state


def test_the_picture_is_the_table() -> None:
    """People read the docstring, and the program reads the table."""
    picture = {
        (SidecarState(state), LifecycleEvent(event)): (SidecarState(then), Action(action))
        for state, event, then, action in ARROW.findall(lifecycle.__doc__ or "")
    }

    assert picture == TABLE


def test_a_life_that_goes_well() -> None:
    """The trainer starts it, talks to it, and announces its end."""
    assert (
        after(LifecycleEvent.START, LifecycleEvent.READY, LifecycleEvent.STOP, LifecycleEvent.EXITED) is IDLE
    )


def test_a_simulator_that_failed_is_started_again() -> None:
    """The trainer decides; the sidecar only reports."""
    assert after(LifecycleEvent.START, LifecycleEvent.EXITED) is FAILED
    assert after(LifecycleEvent.START, LifecycleEvent.EXITED, LifecycleEvent.START) is STARTING


@pytest.mark.parametrize("state", [STARTING, READY, STOPPING])
def test_a_simulator_is_not_started_where_one_runs(state) -> None:
    """Rule 1: two with the same ROS names would unregister each other from the master."""
    assert lifecycle.step(state, LifecycleEvent.START) is None


@pytest.mark.parametrize("state", [state for state in SidecarState if state is not STARTING])
def test_only_a_starting_simulator_gets_ready(state) -> None:
    """Rule 2: a response that was sent before the simulator died proves nothing."""
    assert lifecycle.step(state, LifecycleEvent.READY) is None


@pytest.mark.parametrize("state", [STARTING, READY])
def test_an_exit_that_nobody_announced_is_a_fault(state) -> None:
    """Rule 3: this holds for every exit code."""
    assert lifecycle.step(state, LifecycleEvent.EXITED) == (FAILED, Action.BLAME)


def test_an_exit_after_an_announced_stop_is_wanted() -> None:
    """Rule 3: this holds also if it had to be killed at the deadline."""
    assert (
        after(LifecycleEvent.START, LifecycleEvent.STOP, LifecycleEvent.DEADLINE, LifecycleEvent.EXITED)
        is IDLE
    )


def test_a_stop_can_be_repeated() -> None:
    """Rule 4: a second request may shorten the deadline."""
    assert lifecycle.step(STOPPING, LifecycleEvent.STOP) == (STOPPING, Action.WAIT)


@pytest.mark.parametrize("state", [IDLE, FAILED])
def test_where_nothing_runs_there_is_nothing_to_stop(state) -> None:
    """Rule 6: the reason of a failure also stays readable."""
    assert lifecycle.step(state, LifecycleEvent.STOP) is None


@pytest.mark.parametrize("state", SidecarState)
def test_the_end_of_the_container_is_allowed_everywhere(state) -> None:
    """Rule 5: a kubelet sends only one request."""
    running = state in {STARTING, READY, STOPPING}

    step = lifecycle.step(state, LifecycleEvent.SHUTDOWN)
    assert step == ((STOPPING, Action.TERMINATE) if running else (state, Action.NOTHING))


def test_every_state_can_be_left_and_reached() -> None:
    """A simulator in a state without a way out would be lost."""
    ways = {(state, then) for (state, _), (then, _) in TABLE.items() if state is not then}

    assert {state for state, _ in ways} == {then for _, then in ways} == set(SidecarState)


def test_what_the_table_does_not_have_is_refused() -> None:
    """Rule 6 refuses fifteen of thirty pairs."""
    refused = [pair for pair in product(SidecarState, LifecycleEvent) if lifecycle.step(*pair) is None]

    assert len(refused) == 15
