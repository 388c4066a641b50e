"""Fault specifications, and the state of a simulator's life with them."""

import pytest

from palaestra_sim.faults.fault_state import FaultState
from palaestra_sim.faults.parser import parse
from palaestra_sim.faults.schedule import FaultSchedule, Life


@pytest.fixture
def schedule():
    """`schedule("crash:step=3 slow:latency_ms=5", seed=0, simulator="robotino", number=1)`."""

    def make(text, **life):
        return FaultSchedule(faults=parse(text, "test"), life=Life(**{"simulator": "robotino", **life}))

    return make


@pytest.fixture
def course(schedule):
    """Return the fault state of a life; it takes the same arguments as `schedule`."""
    return lambda text, **life: FaultState(schedule(text, **life))
