"""The effects of faults on a process.

Faults that end the process are tested with real processes elsewhere.
"""

import pytest

from palaestra_sim.faults import ProcessFaults
from palaestra_sim.faults.parser import parse


class Endings:
    """A recorder of the effects that a fault would have on the process."""

    def __init__(self):
        self.done = []

    def end(self, status):
        """Record the exit code that the process would have."""
        self.done.append(("end", status))

    def lose_master(self):
        """Record that the simulator lost the ROS master."""
        self.done.append("lose_master")

    def lose_names(self):
        """Record that the simulator lost its names."""
        self.done.append("lose_names")


@pytest.fixture
def endings():
    """Return the recorder of effects."""
    return Endings()


@pytest.mark.parametrize(
    ("text", "done", "goes_on"),
    [
        ("exit:code=3", [("end", 3)], False),
        ("master_lost", ["lose_master"], False),
        ("names_lost", ["lose_names"], True),
        ("names_lost exit", ["lose_names", ("end", 0)], False),
        ("exit names_lost", [("end", 0)], False),
    ],
)
def test_faults_happen_in_order_until_one_ends_the_stub(endings, text, done, goes_on):
    """A process that has ended can have no further fault."""
    assert ProcessFaults(endings).happen(parse(text, "test")) is goes_on

    assert endings.done == done


def test_no_fault_lets_the_stub_go_on(endings):
    """Most requests have no fault, and must work as usual."""
    assert ProcessFaults(endings).happen(())
    assert endings.done == []


def test_a_fault_is_logged(endings, caplog):
    """Without the log line, a person would take the fault for a bug of the stub."""
    ProcessFaults(endings).happen(parse("exit:step=5", "test"))

    assert caplog.messages == ["fault: exit:step=5"]
