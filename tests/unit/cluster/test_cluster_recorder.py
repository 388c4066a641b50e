"""Events whose names exist already, or that must be written once."""

import pytest

from palaestra.cluster import AlreadyExists, NotFound
from palaestra.cluster.recorder import Recorder

JOB = {
    "apiVersion": "palaestra.dev/v1alpha1",
    "kind": "TrainingJob",
    "metadata": {"name": "job", "namespace": "lab", "uid": "7"},
}


class Server:
    """A fake API server that keeps events by their names."""

    def __init__(self):
        self.events = {}
        self.requests = []

    def create(self, _, event):
        """Store an event."""
        self.requests.append("create")
        name = event["metadata"]["name"]
        if name in self.events:
            raise AlreadyExists(409, "AlreadyExists", name)
        self.events[name] = event

    def get(self, _, namespace, name):
        """Return an event."""
        self.requests.append("get")
        if name not in self.events:
            raise NotFound(404, "NotFound", f"{namespace}/{name}")
        return self.events[name]

    def merge(self, _, namespace, name, change):
        """Change an event."""
        self.requests.append("merge")
        self.events[name] = self.get(None, namespace, name) | change


@pytest.fixture
def server():
    """Return an API server without events."""
    return Server()


def counts(server):
    """Return the counts of all events."""
    return [event["count"] for event in server.events.values()]


def test_an_event_that_another_process_wrote_once_is_left_as_it_is(server):
    """A new leader reports the same fact; a count of 2 would mean that it happened twice."""
    Recorder(server).record(JOB, "Normal", "Planned", "made a Job", once=True)
    leader = Recorder(server)

    leader.record(JOB, "Normal", "Planned", "made a Job", once=True)
    leader.record(JOB, "Normal", "Planned", "made a Job", once=True)

    assert counts(server) == [1]
    assert server.requests == ["create", "create"]


def test_an_event_that_happens_again_is_counted_across_processes(server):
    """An operator that was restarted continues the count of the events in the cluster."""
    Recorder(server).record(JOB, "Warning", "Stalled", "no step for 600 s")

    Recorder(server).record(JOB, "Warning", "Stalled", "no step for 600 s")

    assert counts(server) == [2]


def test_only_so_many_counts_are_remembered(server, monkeypatch):
    """An operator that runs for months would otherwise need more and more memory."""
    monkeypatch.setattr("palaestra.cluster.recorder.REMEMBERED", 1)
    recorder = Recorder(server)

    for message in ("first", "second", "first"):
        recorder.record(JOB, "Normal", "Planned", message, once=True)

    assert counts(server) == [1, 1]
    assert server.requests == ["create"] * 3  # the recorder has forgotten "first", so it asks the server
