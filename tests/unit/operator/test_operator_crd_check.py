"""The operator writes only those conditions that the CustomResourceDefinition in the cluster accepts."""

import pytest

from palaestra.api.crd import schema
from palaestra.cluster import ApiError
from palaestra.operator.crd_check import CrdCheck

BEFORE = ["Accepted", "Running", "Suspended", "Succeeded", "Failed"]
NOW = [*BEFORE, "Reconciling", "Stalled"]


class Server:
    """An API server whose definition accepts these types of conditions.

    With None, the server does not respond.
    """

    def __init__(self, types):
        self.types = types

    def within(self, _):
        """Return the same server."""
        return self

    def schema(self, *_):
        """Return the schema of the definition."""
        if self.types is None:
            raise ApiError(0, "", "no answer")
        served = schema()
        conditions = served["properties"]["status"]["properties"]["conditions"]
        conditions["items"]["properties"]["type"]["enum"] = self.types
        return served


@pytest.fixture
def looks():
    """Return a list that gets an item each time all jobs are queued again."""
    return []


@pytest.fixture
def definition(looks):
    """`definition(types)` returns a check that has read the definition once, and its server."""

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
    """The check also queues every job, because an older status may lack a condition."""
    made, _ = definition(NOW)

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_an_older_definition_gets_no_condition_that_it_would_refuse(definition, looks):
    """The API server would refuse the whole status, and the operator could accept no job any more."""
    made, server = definition(BEFORE)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running")
    assert looks == []

    server.types = NOW
    made.look()

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_a_status_keeps_its_conditions_while_the_definition_cannot_be_read(definition):
    """Without this rule the operator would remove the conditions from every job and add them again later.

    This happened when the API server was busy during the operator's start.
    """
    made, _ = definition(None)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running", "Stalled")
    assert made.accepted(status("Running"), status("Running", "Stalled")) == status("Running")
    assert made.accepted(None, status("Reconciling")) == status()
