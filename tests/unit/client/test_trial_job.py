"""The job that `palaestra try` creates from a user's job, and the report of its end."""

import pytest

from palaestra.cluster.errors import NotFound
from palaestra.smoke_test import TrialFailed, attempt


class Server:
    """An API server that gives every created job a fixed status at once, and keeps the created object."""

    def __init__(self, **status):
        self.status = {"phase": "Succeeded", **status}

    def create(self, _, obj):
        """Keep the object, and return it as the API server would store it."""
        self.made = obj
        return {**obj, "metadata": {"namespace": "lab", "name": "trial-x", "uid": "u"}}

    def get(self, *_):
        """Return the job with its status."""
        return {"status": self.status}

    def delete(self, *_, **__):
        """Raise NotFound, as if somebody else had deleted the object."""
        raise NotFound(404, "NotFound", "gone")


@pytest.mark.parametrize(
    ("written", "created"),
    [
        pytest.param({}, {"retain": "Delete"}, id="nothing"),
        pytest.param({"size": "2Gi"}, {"retain": "Delete", "size": "2Gi"}, id="a size"),
        pytest.param({"retain": "Keep"}, {"retain": "Keep"}, id="to be kept"),
        pytest.param({"existingClaim": "runs"}, {"existingClaim": "runs"}, id="an existing claim"),
    ],
)
def test_the_claims_of_a_trial_go_with_it_unless_its_author_keeps_them(written, created):
    """A trial sets `retain: Delete`, unless the author of the job has set `retain` or `existingClaim`.

    The API refuses `Delete` together with an existing claim.
    """
    server = Server()
    spec = {"storage": written} if written else {}

    attempt(server, {"metadata": {"name": "trial"}, "spec": spec}, within_s=1, report=str)

    assert server.made["spec"]["storage"] == created


@pytest.mark.parametrize(
    ("phase", "accepted", "subject"),
    [("Pending", "True", "Running"), ("Pending", "False", "Accepted"), ("Failed", "True", "Failed")],
)
def test_a_trial_that_did_not_succeed_reports_the_whole_message(phase, accepted, subject, monkeypatch):
    """The report must take the message from the one condition that has it: the others only refer to it."""
    conditions = [
        {
            "type": kind,
            "status": accepted if kind == "Accepted" else str(kind == phase),
            "reason": "ImagePull",
            "message": "the whole message" if kind == subject else f"see the condition {subject}",
        }
        for kind in ("Accepted", "Running", "Suspended", "Succeeded", "Failed")
    ]
    server = Server(phase=phase, conditions=conditions)
    monkeypatch.setattr("palaestra.smoke_test.PERIOD_S", 0.01)

    with pytest.raises(TrialFailed, match="ImagePull: the whole message"):
        attempt(server, {"metadata": {"name": "trial"}, "spec": {}}, within_s=0.1, report=str)
