"""Which conditions a status is written with: those that the definition in the cluster takes."""

import pytest

from palaestra.api.crd import schema
from palaestra.cluster import ApiError
from palaestra.operator.crd_check import CrdCheck

BEFORE = ["Accepted", "Running", "Suspended", "Succeeded", "Failed"]
NOW = [*BEFORE, "Reconciling", "Stalled"]


class Server:
    """An API server that publishes a definition with these types of conditions; None: it does not answer."""

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
    """One item for each time that all jobs were to be looked at again."""
    return []


@pytest.fixture
def definition(looks):
    """`definition(types)`: one that was compared once, with its server."""

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
    """And every job is looked at, as its status may lack one."""
    made, _ = definition(NOW)

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_an_older_definition_gets_no_condition_that_it_would_refuse(definition, looks):
    """An API server refuses the whole status for it: no job would be accepted any more."""
    made, server = definition(BEFORE)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running")
    assert looks == []

    server.types = NOW
    made.look()

    assert made.accepted({}, status("Running", "Stalled")) == status("Running", "Stalled")
    assert looks == [1]


def test_a_status_keeps_its_conditions_while_the_definition_cannot_be_read(definition):
    """An operator that starts beside a busy API server took them from every job, and gave them back later."""
    made, _ = definition(None)

    assert made.accepted(status("Stalled"), status("Running", "Stalled")) == status("Running", "Stalled")
    assert made.accepted(status("Running"), status("Running", "Stalled")) == status("Running")
    assert made.accepted(None, status("Reconciling")) == status()
