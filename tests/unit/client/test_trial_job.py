"""The job that `palaestra try` makes of its author's."""

import pytest

from palaestra.cluster.errors import NotFound
from palaestra.trial import attempt


class Server:
    """An API server in which every job succeeds at once; it keeps what was created."""

    def create(self, _, obj):
        """Keep the object, and return it as stored."""
        self.made = obj
        return {**obj, "metadata": {"namespace": "lab", "name": "trial-x", "uid": "u"}}

    def get(self, *_):
        """Return the job, which has succeeded."""
        return {"status": {"phase": "Succeeded"}}

    def delete(self, *_, **__):
        """Find that somebody else was faster."""
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
    """A claim that was there before is refused with `Delete`; what the author has set stays."""
    server = Server()
    spec = {"storage": written} if written else {}

    attempt(server, {"metadata": {"name": "trial"}, "spec": spec}, within_s=1, tell=str)

    assert server.made["spec"]["storage"] == created
