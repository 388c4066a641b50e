"""The number of faults that a run tolerates, and the duration above which a step is slow."""

from __future__ import annotations

import time

import pytest

from palaestra_trainer.errors import FaultBudgetSpent, SimulatorDead, SimulatorHung
from palaestra_trainer.simulators.budget import Group, RestartBudget, RestartLimit
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.simulators.stats import Pace
from palaestra_trainer.waiting.greenlets import let_others, take_turns

DEAD, HUNG = SimulatorDead("robotino", "closed the connection"), SimulatorHung("robotino", "does not answer")


def test_the_message_tells_flapping_from_an_accident():
    """A person reads the message hours later.

    So the message has the types of faults, the time window and the remedy.
    """
    budget = RestartBudget("collect-0", RestartLimit(restarts=10), clock=lambda: 0.0)
    for fault in [DEAD] * 9 + [HUNG]:
        budget.spend(fault)

    with pytest.raises(FaultBudgetSpent) as told:
        budget.spend(DEAD)

    assert str(told.value) == (
        "collect-0: flapping: 10 restarts within 600 s did not repair the simulator "
        "(dead 9, hung 1; last: robotino: closed the connection); "
        "read the simulator's log, or raise restart.limit"
    )


def test_a_budget_of_nothing_bears_nothing():
    """With `restart.limit: 0` the first fault ends the run."""
    budget = RestartBudget("collect-0", RestartLimit(restarts=0))

    with pytest.raises(FaultBudgetSpent, match=r"^collect-0: 0 restarts within 600 s .* \(last: robotino: "):
        budget.spend(DEAD)


def test_three_restarts_in_a_short_time_are_flapping():
    """Two restarts may be chance. Restarts outside the time window do not count."""
    times = iter([0.0, 50.0, 99.0, 100.0, 199.0])
    budget = RestartBudget("collect-0", RestartLimit(within_s=100.0), clock=lambda: next(times))
    flapping = []
    for _ in range(5):
        budget.spend(DEAD)
        flapping.append(budget.flapping)

    assert flapping == [False, False, True, True, False]


@pytest.mark.parametrize(("left", "least", "losses"), [(4, 2, 2), (4, None, 0), (1, 1, 0), (2, 5, 0)])
def test_a_group_loses_as_many_as_it_can_do_without(left, least, losses):
    """By default each simulator of a group is needed."""
    group = Group(left, least)

    assert [group.lose_one() for _ in range(left)] == [True] * losses + [False] * (left - losses)


@pytest.mark.parametrize(
    ("usual", "seconds", "slow"),
    [(0.004, 0.051, True), (0.004, 0.049, False), (0.010, 0.099, False), (0.010, 0.101, True)],
)
def test_slow_is_a_step_of_ten_times_the_median_and_fifty_milliseconds(usual, seconds, slow):
    """Ten times the median ignores normal jitter, and 50 ms ignores delays that no person would notice."""
    pace = Pace()
    assert not any(pace.slow(usual) for _ in range(10))

    assert pace.slow(seconds) is slow


def test_the_first_steps_are_never_slow():
    """There are no earlier steps to compare with, and connecting takes time."""
    pace = Pace()

    assert not any(pace.slow(1.0 + number) for number in range(10))


def test_a_simulator_that_has_become_slower_is_not_reported_for_ever():
    """After fifty steps the new duration counts as normal."""
    pace = Pace()
    for _ in range(200):
        pace.slow(0.004)

    assert sum(pace.slow(0.1) for _ in range(200)) == 50


def test_who_waits_for_a_slow_simulator_is_not_slow(make_member):
    """Simulators take turns in one thread, so each is measured only by its own part of the time."""
    told = []
    watcher = NullWatcher()
    watcher.slow = lambda name, seconds: told.append((name, seconds > 0.05))
    members = [make_member("collect-0"), make_member("collect-1")]
    restarters = [Restarter(member, watcher=watcher) for member in members]
    for restarter in restarters:
        restarter.reset(1)

    for work in [let_others] * 11 + [compute_for_a_while]:
        members[0].take_step, members[1].take_step = let_others, work
        take_turns([lambda: restarters[0].step(0), lambda: restarters[1].step(0)])

    assert told == [("collect-1", True)]


def compute_for_a_while():
    """Use the processor for a tenth of a second."""
    until = time.perf_counter() + 0.1
    while time.perf_counter() < until:
        pass
