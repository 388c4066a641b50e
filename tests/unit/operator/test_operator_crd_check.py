"""A status is written only with the conditions that the definition in the cluster accepts."""

import pytest

from palaestra.api.crd import schema
from palaestra.cluster import ApiError
from palaestra.operator.crd_check import CrdCheck

BEFORE = ["Accepted", "Running", "Suspended", "Succeeded", "Failed"]
NOW = [*BEFORE, "Reconciling", "Stalled"]


class Server:
    """An API server that publishes a definition with these types of conditions.

    With None, it does not respond.
    """

    def __init__(self, types):
        self.types = types

    def within(self, _):
        """Return the same server."""
        return self

    def schema(self, *_):
        """Return the definition."""
        if self.types is None:
            raise ApiError(0, "", "no answer")
        served = schema()
        conditions = served["properties"]["status"]["properties"]["conditions"]
        conditions["items"]["properties"]["type"]["enum"] = self.types
        return served


@pytest.fixture
def looks():
    """Return a list with one item for each time that all jobs were queued again."""
    return []


@pytest.fixture
def definition(looks):
    """`definition(types)` returns a check that has compared the definition once, and its server."""

    def make(types):
        server = Server(types)
        made = CrdCheck(server, lambda: looks.append(1))
        made.look()
        return made, server

    return make


def status(*types):
    """Return a status with conditions of these types."""
    return {"conditions": [{"type": each} for each in types]}


def test_a_definition_of_this_release_takes_every_condition(definition, looks):
    """Every job is also queued, because its status may lack a condition."""
    made, _ = definition(NOW)

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_an_older_definition_gets_no_condition_that_it_would_refuse(definition, looks):
    """An API server would refuse the whole status for it, and no job would be accepted any more."""
    made, server = definition(BEFORE)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running")
    assert looks == []

    server.types = NOW
    made.look()

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_a_status_keeps_its_conditions_while_the_definition_cannot_be_read(definition):
    """Otherwise an operator would remove them from every job and restore them later.

    This occurred when the API server was busy while the operator started.
    """
    made, _ = definition(None)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running", "Stalled")
    assert made.accepted(status("Running"), status("Running", "Stalled")) == status("Running")
    assert made.accepted(None, status("Reconciling")) == status()
