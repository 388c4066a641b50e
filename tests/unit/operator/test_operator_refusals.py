"""When the operator asks why a Job has no pod, and when it does not."""

import pytest

from palaestra.cluster import NotFound
from palaestra.operator.refusals import PATIENCE_S, RECHECK_S, REMEMBERED, Refusals
from palaestra.operator.strangers import Strangers

KEY = ("robots", "job")
FAILED = {"reason": "FailedCreate", "message": "exceeded quota"}


class Server:
    """An API server of Jobs and events, and a clock beside it."""

    def __init__(self):
        self.now, self.asked, self.jobs = 100.0, 0, {}
        self.about = "reason=FailedCreate"

    def list(self, resource, namespace, *, fields):
        """Return the one event that there is."""
        assert (resource.plural, namespace) == ("events", "robots")
        assert fields == f"involvedObject.uid=u,{self.about}"
        self.asked += 1
        return [FAILED]

    def get(self, resource, namespace, name):
        """Return a Job."""
        assert (resource.plural, namespace) == ("jobs", "robots")
        self.asked += 1
        if name not in self.jobs:
            raise NotFound(404, "NotFound", name)
        return self.jobs[name]


@pytest.fixture
def server():
    """A server that counts what it is asked."""
    return Server()


def job(**changes):
    """Return a Job that should have a pod."""
    return {
        "metadata": {"name": "job-0", "namespace": "robots", "uid": "u"},
        "spec": {},
        "status": {},
        **changes,
    }


def pod(phase):
    """Return its pod."""
    return {
        "metadata": {"uid": "p", "namespace": "robots", "ownerReferences": [{"uid": "u"}]},
        "status": {"phase": phase},
    }


def test_a_new_job_is_given_some_seconds(server):
    """Nearly all have a pod at once; nobody is asked."""
    refusals = Refusals(server, lambda: server.now)

    events, again_s = refusals.of([job()], [])

    assert (events, server.asked) == ([], 0)
    assert again_s == PATIENCE_S


def test_after_that_its_events_are_read_now_and_then(server):
    """Not at every look: a job is looked at many times a second while its pods change."""
    refusals = Refusals(server, lambda: server.now)
    refusals.of([job()], [])
    server.now += PATIENCE_S

    assert refusals.of([job()], []) == ([FAILED], RECHECK_S)
    assert refusals.of([job()], []) == ([FAILED], RECHECK_S)
    assert server.asked == 1
    server.now += RECHECK_S
    refusals.of([job()], [])
    assert server.asked == 2


def test_a_job_whose_last_pod_has_failed_lacks_one(server):
    """The second pod may be refused though the first was not."""
    refusals = Refusals(server, lambda: server.now)
    refusals.of([job()], [pod("Failed")])
    server.now += PATIENCE_S

    assert refusals.of([job()], [pod("Failed")])[0] == [FAILED]


@pytest.mark.parametrize(
    ("jobs", "pods"),
    [
        ([], []),
        ([job()], [pod("Pending")]),
        ([job(spec={"suspend": True})], []),
        ([job(status={"conditions": [{"type": "Complete", "status": "True"}]})], []),
    ],
    ids=["no Job", "a pod", "suspended", "ended"],
)
def test_nobody_is_asked_where_no_pod_is_lacking(jobs, pods, server):
    """While nothing changes, nothing is asked for."""
    refusals = Refusals(server, lambda: server.now)
    refusals.of(jobs, pods)
    server.now += PATIENCE_S

    assert refusals.of(jobs, pods) == ([], None)
    assert server.asked == 0


def waiting_pod(**status):
    """Return a pod that a node has taken."""
    return {
        "metadata": {"uid": "u", "namespace": "robots"},
        "spec": {"nodeName": "node-1"},
        "status": {"phase": "Pending", **status},
    }


def test_a_pod_that_waits_for_its_volumes_has_its_warnings_read(server):
    """After some seconds, as a Job: most volumes come at once."""
    server.about = "type=Warning"
    refusals = Refusals(server, lambda: server.now)
    refusals.of([], [waiting_pod()])
    assert server.asked == 0
    server.now += PATIENCE_S

    assert refusals.of([], [waiting_pod()]) == ([FAILED], RECHECK_S)


@pytest.mark.parametrize(
    "pod",
    [
        {**waiting_pod(), "spec": {}},
        waiting_pod(phase="Running"),
        waiting_pod(conditions=[{"type": "PodReadyToStartContainers", "status": "True"}]),
        {**waiting_pod(), "metadata": {"uid": "u", "namespace": "robots", "deletionTimestamp": "now"}},
    ],
    ids=["no node", "runs", "pulls images", "deleted"],
)
def test_nobody_is_asked_about_a_pod_that_waits_for_something_else(pod, server):
    """Its own status tells of that."""
    refusals = Refusals(server, lambda: server.now)
    refusals.of([], [pod])
    server.now += PATIENCE_S

    assert refusals.of([], [pod]) == ([], None)
    assert server.asked == 0


def test_what_was_deleted_while_it_lacked_something_is_forgotten_in_the_end(server):
    """Nobody tells of it; an operator runs for months."""
    refusals = Refusals(server, lambda: server.now)
    refusals.of([job()], [])
    server.now += PATIENCE_S
    for i in range(REMEMBERED):
        refusals.of([job(metadata={"name": "x", "namespace": "robots", "uid": f"u{i}"})], [])

    assert refusals.of([job()], []) == ([], PATIENCE_S)


def test_a_stranger_is_looked_at_again_until_it_is_gone(server):
    """A name becomes free without any event that reaches us."""
    server.jobs["job-0"] = job()
    strangers = Strangers(server, lambda: server.now)
    strangers.meet(KEY, "job-0")
    assert strangers.among(KEY, ()) == [job()]
    del server.jobs["job-0"]

    assert strangers.among(KEY, ()) == [job()], "not asked at every look"
    server.now += RECHECK_S
    assert strangers.among(KEY, ()) == []


def test_who_is_in_the_cache_is_no_stranger(server):
    """The name was taken by our own Job, which the cache had not heard of yet."""
    server.jobs["job-0"] = job()
    strangers = Strangers(server, lambda: server.now)
    strangers.meet(KEY, "job-0")

    assert strangers.among(KEY, {"job-0"}) == []
    assert strangers.among(KEY, ()) == []
