"""Builders of fault schedules, and of the fault state during one run of a simulator."""

import pytest

from palaestra_sim.faults.fault_state import FaultState
from palaestra_sim.faults.parser import parse
from palaestra_sim.faults.schedule import FaultSchedule, Life


@pytest.fixture
def schedule():
    """`schedule(text, simulator="robotino", number=1)` returns the schedule of the faults in `text`."""

    def make(text, **life):
        return FaultSchedule(faults=parse(text, "test"), life=Life(**{"simulator": "robotino", **life}))

    return make


@pytest.fixture
def course(schedule):
    """Return a builder of the fault state of a run; it takes the same arguments as `schedule`."""
    return lambda text, **life: FaultState(schedule(text, **life))
