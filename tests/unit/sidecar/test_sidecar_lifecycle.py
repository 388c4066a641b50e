"""The states of a simulator: a table defines the transitions, and a module docstring shows it."""

import re
from itertools import product

import pytest

from palaestra_protocol.control import SidecarState
from palaestra_sim.sidecar import lifecycle
from palaestra_sim.sidecar.lifecycle import TABLE, Action, LifecycleEvent

IDLE, STARTING, READY, STOPPING, FAILED = SidecarState
ARROW = re.compile(r"^ {4}(\w+) +--(\w+)--> +(\w+) +(\w+)$", re.MULTILINE)


def after(*events: LifecycleEvent, state: SidecarState = IDLE) -> SidecarState:
    """Return the state after these events, each of which the table must allow."""
    for event in events:
        step = lifecycle.step(state, event)
        assert step is not None, f"{event} in {state}"
        state = step[0]
    return state


def test_the_picture_is_the_table() -> None:
    """People read the docstring, but the program uses the table, so both must agree."""
    picture = {
        (SidecarState(state), LifecycleEvent(event)): (SidecarState(then), Action(action))
        for state, event, then, action in ARROW.findall(lifecycle.__doc__ or "")
    }

    assert picture == TABLE


def test_a_life_that_goes_well() -> None:
    """The trainer starts the simulator, uses it, and announces its end."""
    assert (
        after(LifecycleEvent.START, LifecycleEvent.READY, LifecycleEvent.STOP, LifecycleEvent.EXITED) is IDLE
    )


def test_a_simulator_that_failed_is_started_again() -> None:
    """The trainer decides about a restart; the sidecar only reports the failure."""
    assert after(LifecycleEvent.START, LifecycleEvent.EXITED) is FAILED
    assert after(LifecycleEvent.START, LifecycleEvent.EXITED, LifecycleEvent.START) is STARTING


@pytest.mark.parametrize("state", [STARTING, READY, STOPPING])
def test_a_simulator_is_not_started_where_one_runs(state) -> None:
    """Rule 1: two simulators with equal ROS names would unregister each other from the master."""
    assert lifecycle.step(state, LifecycleEvent.START) is None


@pytest.mark.parametrize("state", [state for state in SidecarState if state is not STARTING])
def test_only_a_starting_simulator_gets_ready(state) -> None:
    """Rule 2: a trainer's report of readiness may arrive after the simulator has ended."""
    assert lifecycle.step(state, LifecycleEvent.READY) is None


@pytest.mark.parametrize("state", [STARTING, READY])
def test_an_exit_that_nobody_announced_is_a_fault(state) -> None:
    """Rule 3: every exit code counts as a failure if no stop was announced."""
    assert lifecycle.step(state, LifecycleEvent.EXITED) == (FAILED, Action.BLAME)


def test_an_exit_after_an_announced_stop_is_wanted() -> None:
    """Rule 3: an announced stop is not a failure, even if the simulator had to be killed at the deadline."""
    assert (
        after(LifecycleEvent.START, LifecycleEvent.STOP, LifecycleEvent.DEADLINE, LifecycleEvent.EXITED)
        is IDLE
    )


def test_a_stop_can_be_repeated() -> None:
    """Rule 4: a second request to stop may shorten the deadline."""
    assert lifecycle.step(STOPPING, LifecycleEvent.STOP) == (STOPPING, Action.WAIT)


@pytest.mark.parametrize("state", [IDLE, FAILED])
def test_where_nothing_runs_there_is_nothing_to_stop(state) -> None:
    """Rule 6: the state does not change, so the reason of a failure stays readable."""
    assert lifecycle.step(state, LifecycleEvent.STOP) is None


@pytest.mark.parametrize("state", SidecarState)
def test_the_end_of_the_container_is_allowed_everywhere(state) -> None:
    """Rule 5: a kubelet sends SIGTERM only once, so every state accepts it."""
    running = state in {STARTING, READY, STOPPING}

    step = lifecycle.step(state, LifecycleEvent.SHUTDOWN)
    assert step == ((STOPPING, Action.TERMINATE) if running else (state, Action.NOTHING))


def test_every_state_can_be_left_and_reached() -> None:
    """Without a transition out of a state, a simulator in that state could never be started again."""
    ways = {(state, then) for (state, _), (then, _) in TABLE.items() if state is not then}

    assert {state for state, _ in ways} == {then for _, then in ways} == set(SidecarState)


def test_what_the_table_does_not_have_is_refused() -> None:
    """Rule 6 refuses each event that has no meaning in the current state: 15 of the 30 pairs."""
    refused = [pair for pair in product(SidecarState, LifecycleEvent) if lifecycle.step(*pair) is None]

    assert len(refused) == 15
