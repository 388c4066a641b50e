"""The states of a simulator that other threads see while its owner changes them."""

import os
import sys
import threading

import pytest

from palaestra_protocol.control import SidecarState, SimulatorState
from palaestra_sim.sidecar.lifecycle import LifecycleEvent
from palaestra_sim.sidecar.process import CommandLine
from palaestra_sim.sidecar.simulator import SupervisedSimulator
from tests.integration.sidecar.conftest import DEADLINE_S, eventually


class Watched(SupervisedSimulator):
    """A simulator that records every state that other threads can see."""

    def __setattr__(self, name, value):
        super().__setattr__(name, value)
        if name == "state":
            self.__dict__.setdefault("seen", []).append(value)


@pytest.mark.parametrize("statement", ["sys.exit(0)", "os.kill(os.getpid(), signal.SIGKILL)"])
def test_no_state_is_seen_half_made(statement) -> None:
    """The trainer may read the state at any time.

    A failed state must always show how the simulator ended.
    """
    program = (sys.executable, "-I", "-S", "-c", f"import os, signal, sys; {statement}")
    simulator = Watched(
        CommandLine(arguments=program, environment=dict(os.environ)),
        SimulatorState(state=SidecarState.IDLE, driver="command", world="arena.wbt"),
    )
    owner = threading.Thread(target=simulator.run, daemon=True)
    owner.start()

    simulator.ask(LifecycleEvent.START)
    eventually(lambda: simulator.state.faults)
    simulator.shut_down()
    owner.join(DEADLINE_S)

    failed = [state for state in simulator.seen if state.state is SidecarState.FAILED]
    assert failed
    assert all(state.faults == 1 and state.pid is None and state.last_exit for state in failed)
