"""By a read and by preconditions, the operator detects that it has decided with an outdated cache."""

import pytest

from palaestra.api.reasons import Reason
from palaestra.cluster import Conflict
from palaestra.decide import Delete, Discard, Stop
from palaestra.decide.decision import Basis
from palaestra.operator.executor import Executor
from palaestra.operator.fenced_client import FencedClient
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import ForeignJobs, RejectedCreations

RAW = {"metadata": {"namespace": "robots", "name": "job", "uid": "u", "resourceVersion": "7"}}
BASIS = Basis(uid="job-uid", version="20", pods=frozenset({("pod-1", "30")}))
STOP = Stop(job="job-0", replica=0, reason=Reason.STALLED, message="it", basis=BASIS)


def a_pod(uid="pod-1", version="30", owner="job-uid", replica="0"):
    """Return a pod of the replica as the API server has it."""
    labels = {"palaestra.dev/job": "job", "palaestra.dev/job-uid": "u", "palaestra.dev/replica": replica}
    metadata = {"name": uid, "uid": uid, "resourceVersion": version, "labels": labels}
    return {"metadata": {**metadata, "ownerReferences": [{"uid": owner}]}, "status": {"phase": "Running"}}


class Server:
    """An API server with one TrainingJob and its pods; it records the writes."""

    def __init__(self, version="7", pods=(), *, conflict=False):
        self.version, self.pods, self.conflict = version, pods, conflict
        self.written = []

    def get(self, *_):
        """Return the TrainingJob."""
        return {"metadata": {**RAW["metadata"], "resourceVersion": self.version}}

    def list(self, *_, **__):
        """Return the pods."""
        return list(self.pods)

    def merge(self, *arguments, **preconditions):
        """Accept or refuse a patch."""
        self._write("patch", arguments[2:], preconditions)

    def delete(self, *arguments, **preconditions):
        """Accept or refuse a deletion."""
        self._write("delete", arguments[2:], preconditions)

    def _write(self, verb, arguments, preconditions):
        if self.conflict:
            raise Conflict(409, "Conflict", "the object has been modified")
        self.written.append((verb, *arguments, preconditions))


def carry_out(api, *actions):
    """Execute actions, and return whether all of them were executed."""
    try:
        Executor(api, FencedClient(api, lambda: True), ForeignJobs(api), RejectedCreations()).carry_out(
            RAW, actions
        )
    except Outdated:
        return False
    return True


@pytest.mark.parametrize(
    ("there", "done"),
    [
        ({"pods": [a_pod()]}, True),
        ({"pods": [a_pod()], "version": "8"}, False),
        ({"pods": [a_pod(version="31")]}, False),
        ({"pods": [a_pod(), a_pod("pod-2", "40")]}, False),
        ({"pods": []}, False),
        ({"pods": [a_pod(), a_pod("pod-2", "40", owner="nobody")]}, True),
        ({"pods": [a_pod(), a_pod("pod-2", "40", replica="none")]}, True),
        ({"pods": [a_pod()], "conflict": True}, False),
    ],
    ids=[
        "as the cache says", "the spec changed", "the pod changed", "there is a new pod", "the pod is gone",
        "a pod that only says to be the replica's", "a pod with other labels by now", "the Job changed",
    ],
)  # fmt: skip
def test_a_replica_is_stopped_only_if_all_is_as_it_was_when_that_was_decided(there, done):
    """If a watch hangs for 90 s, the operator must not stop a pod that has started since."""
    api = Server(**there)

    assert carry_out(api, STOP) is done
    assert bool(api.written) is done


def test_a_job_is_changed_only_in_the_version_that_was_decided_about():
    """Between the read and the patch, another program may resume the Job or create it again."""
    api = Server(pods=[a_pod()])

    carry_out(api, STOP)

    [(_, name, patch, preconditions)] = api.written
    assert (name, patch["metadata"]["uid"], preconditions) == ("job-0", "job-uid", {"resource_version": "20"})


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        (Delete(name="job", uid="u"), ("delete", "job", {"uid": "u", "resource_version": "7"})),
        (
            Discard(job="job-0", replica=0, basis=BASIS),
            ("delete", "job-0", {"uid": "job-uid", "resource_version": "20"}),
        ),
    ],
    ids=["a TrainingJob whose time to live is over", "a suspended Job"],
)
def test_a_deletion_is_of_one_version(action, expected):
    """After the decision, a user may still change the time to live, or a queue may admit the Job."""
    api, late, refusing = Server(), Server(version="8"), Server(conflict=True)

    assert carry_out(api, action)
    assert api.written == [expected]
    assert not carry_out(late, action)
    assert late.written == []
    assert not carry_out(refusing, action)
