"""The effects of faults on a process, except those that end it; those are tested with real processes."""

import pytest

from palaestra_sim.faults import ProcessFaults
from palaestra_sim.faults.parser import parse


class Endings:
    """Record the effects that a process would have on itself."""

    def __init__(self):
        self.done = []

    def end(self, status):
        """Record the exit code."""
        self.done.append(("end", status))

    def lose_master(self):
        """Record the loss of the master."""
        self.done.append("lose_master")

    def lose_names(self):
        """Record the loss of the names."""
        self.done.append("lose_names")


@pytest.fixture
def endings():
    """The recorder of effects."""
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
    """No fault follows after the stub has ended."""
    assert ProcessFaults(endings).happen(parse(text, "test")) is goes_on

    assert endings.done == done


def test_no_fault_lets_the_stub_go_on(endings):
    """Most requests have no fault."""
    assert ProcessFaults(endings).happen(())
    assert endings.done == []


def test_a_fault_is_logged(endings, caplog):
    """Otherwise it would be taken for a bug of the stub."""
    ProcessFaults(endings).happen(parse("exit:step=5", "test"))

    assert caplog.messages == ["fault: exit:step=5"]
