"""A node decides by the reason of a shutdown whether the master means this node."""

import pytest

from palaestra_protocol.ros.shutdown import means_another_node

REPLACED = "Reason: new node registered with same name"


@pytest.mark.parametrize(
    "reason", [f"[/robotino] {REPLACED}", "user request", "", None, 7, "[robotino] hello"]
)
def test_a_node_ends_for_a_reason_that_names_it_or_no_node(reason):
    """`rosnode kill` gives a reason without a name, and another client may give any value."""
    assert not means_another_node(reason, "/robotino")


@pytest.mark.parametrize("named", ["/robotino_2", "/sim/robotino", "/robotin"])
def test_a_node_does_not_end_for_a_reason_that_names_another_node(named):
    """The master sends a shutdown to the port of the old node. The system may have reused this port."""
    assert means_another_node(f"[{named}] {REPLACED}", "/robotino")
