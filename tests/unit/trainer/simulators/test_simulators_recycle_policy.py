"""A healthy simulator is restarted after some resets, at an age, or above a memory size."""

from __future__ import annotations

import pytest

from palaestra_trainer.job.simulator_configuration import Recycle
from palaestra_trainer.simulators.recycle_policy import ASK_MEMORY_EVERY_S, RecyclePolicy

MIB = 2**20


class Clock:
    """A clock that a test sets forward."""

    def __init__(self):
        self.now_s = 100.0

    def __call__(self):
        """Return the time in seconds."""
        return self.now_s


class Memory:
    """A sidecar's report of memory, which counts how often it was requested."""

    def __init__(self, used=None):
        self.used = used
        self.asked = 0

    def __call__(self):
        """Return the bytes in use."""
        self.asked += 1
        return self.used


@pytest.fixture
def clock():
    """Return a clock that does not move by itself."""
    return Clock()


def test_without_limits_nothing_is_ever_due(clock):
    """A job with `recycle: {afterResets: 0}` sets no limit."""
    wear = RecyclePolicy(None, Memory(10**12), clock)
    clock.now_s += 1e9

    assert wear.due(10**6) is None


@pytest.mark.parametrize(("resets", "due"), [(23, None), (24, "24 resets"), (25, "25 resets")])
def test_due_by_resets(clock, resets, due):
    """A real simulator died at its 25th reset.

    After 24 resets, the next reset is the first of a new simulator.
    """
    wear = RecyclePolicy(Recycle(after_resets=24), Memory(), clock)

    assert wear.due(resets) == due


@pytest.mark.parametrize(
    ("resets", "episodes", "due"),
    [
        (0, 20, None),
        (4, 20, None),
        (5, 20, "5 resets"),
        (22, 50, None),
        (23, 50, "23 resets"),
        (0, 24, None),
        (1, 24, "1 resets"),
    ],
)
def test_due_before_several_episodes_where_that_saves_a_restart_amid_them(clock, resets, episodes, due):
    """Fifty episodes need two restarts in any case, even in a simulator that was just restarted."""
    wear = RecyclePolicy(Recycle(after_resets=24), Memory(), clock)

    assert wear.due(resets, episodes) == due


def test_due_by_age_since_it_came_into_use(clock):
    """An hour as a standby is not an hour of work, so a standby is not recycled when it takes over."""
    wear = RecyclePolicy(Recycle(after_minutes=1.5), Memory(), clock)
    clock.now_s += 89.0
    before = wear.due(0)
    clock.now_s += 1.0
    at = wear.due(0)
    wear.begin()

    assert (before, at, wear.due(0)) == (None, "1.5 minutes in use", None)


@pytest.mark.parametrize(("used", "due"), [(400 * MIB, None), (401 * MIB, "401 MiB of memory"), (None, None)])
def test_due_by_memory(clock, used, due):
    """The simulator is due above the limit but not at it, and not while its memory is unknown."""
    wear = RecyclePolicy(Recycle(above_memory_bytes=400 * MIB), Memory(used), clock)
    clock.now_s += ASK_MEMORY_EVERY_S

    assert wear.due(0) == due


def test_memory_is_asked_for_once_a_second_at_most(clock):
    """Episodes may be short, and the sidecar reads each process of the simulator for a response."""
    memory = Memory(0)
    wear = RecyclePolicy(Recycle(above_memory_bytes=MIB), memory, clock)

    for _ in range(30):
        clock.now_s += 0.1
        wear.due(0)

    assert 2 <= memory.asked <= 3


def test_memory_is_not_asked_for_where_it_has_no_limit(clock):
    """A request would cost time, although no limit uses the response."""
    memory = Memory(0)
    wear = RecyclePolicy(Recycle(after_resets=1), memory, clock)
    clock.now_s += 60.0

    wear.due(0)

    assert memory.asked == 0


def test_the_first_limit_that_is_reached_is_the_reason(clock):
    """The log has the reason, so that a user raises the right limit."""
    limits = Recycle(after_resets=24, after_minutes=1, above_memory_bytes=MIB)
    wear = RecyclePolicy(limits, Memory(2 * MIB), clock)
    clock.now_s += 60.0

    assert wear.due(24) == "24 resets"
    assert wear.due(3) == "1.0 minutes in use"
