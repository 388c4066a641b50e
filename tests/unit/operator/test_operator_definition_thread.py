"""The check of the CustomResourceDefinition only informs people and must not end the operator."""

import threading

from palaestra.operator.crd_check import CrdCheck


class Server:
    """An API server with an unexpected schema of TrainingJobs."""

    def __init__(self):
        self.asked = threading.Event()

    def within(self, _):
        """Return the same server."""
        return self

    def schema(self, *_):
        """Return a schema without a type."""
        self.asked.set()
        return {"properties": {"spec": None}}


def test_a_document_that_nobody_foresaw_does_not_end_the_operator(monkeypatch):
    """An exception in a thread ends the whole operator, and would end it again after each restart."""
    broken = []
    monkeypatch.setattr(threading, "excepthook", broken.append)
    server, stopping = Server(), threading.Event()
    definition = CrdCheck(server, lambda: None)

    definition.follow(stopping, 60.0)
    assert server.asked.wait(5)
    stopping.set()
    for thread in [each for each in threading.enumerate() if each.name == "definition"]:
        thread.join(5)

    assert broken == []
    assert definition.outdated is None
