"""All simulators of a run together."""

from __future__ import annotations

import os
import signal
import threading

import pytest

from palaestra_trainer.errors import FaultBudgetSpent, SimulatorHung
from palaestra_trainer.interruption import Interrupted, Interruption
from palaestra_trainer.simulators.fleet import Fleet
from palaestra_trainer.simulators.member import Nobody

DEADLINE_S = 5.0


@pytest.fixture
def make_fleet(make_configuration, make_member):
    """Make a fleet of two members; what is given is the first one's."""

    def make(first=None, **faults):
        members = [first or make_member("collect-0", **faults), make_member("evaluate-0")]
        return Fleet(make_configuration(), members, Nobody()), members

    return make


def test_all_are_started_and_stopped(make_fleet):
    """Those that collect and those that evaluate."""
    fleet, members = make_fleet()

    fleet.start()
    fleet.stop()

    assert [member.log for member in members] == [["start", "stop"]] * 2


def test_one_that_does_not_come_up_ends_the_start(make_fleet):
    """After as many tries as its budget has."""
    fleet, members = make_fleet(starts=range(1, 100))

    with pytest.raises(FaultBudgetSpent, match="collect-0: 10 restarts"):
        fleet.start()

    assert members[0].log == ["start", *["restart"] * 10]


def test_a_signal_does_not_wait_for_simulators_that_start(make_fleet, make_member):
    """Eleven tries of a minute each are long for somebody who pressed Ctrl-C."""
    released = threading.Event()
    member = make_member("collect-0")

    def start():
        member.log.append("start")
        threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
        released.wait(DEADLINE_S)
        raise SimulatorHung("collect-0", "slow")

    member.start = start
    fleet, _ = make_fleet(member)

    with Interruption() as interruption, pytest.raises(Interrupted):
        fleet.start(interruption.check)
    released.set()
    for thread in threading.enumerate():
        if thread.name == "fleet-collect-0":
            thread.join(DEADLINE_S)

    assert member.log == ["start"]
