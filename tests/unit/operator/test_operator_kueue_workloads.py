"""The operator requests the reason why Kueue does not admit a Job only if the Job waits in a queue."""

import pytest

from palaestra.cluster import Forbidden, NotFound, ServerError
from palaestra.operator.bounded_cache import PATIENCE_S, RECHECK_S, REMEMBERED, Answers
from palaestra.operator.unwatched_facts import KueueWorkloads, PodEvents

KEY, UID = ("robots", "job"), "job-uid"
QUEUED = {"kueue.x-k8s.io/queue-name": "trainings"}
SHORT = "insufficient unused quota for cpu"
WAITS = {"status": {"conditions": [{"type": "QuotaReserved", "status": "False", "message": SHORT}]}}


class Server:
    """An API server with one Workload, and a clock."""

    def __init__(self):
        self.now, self.asked, self.refusal = 100.0, [], None

    def list(self, resource, namespace, *, labels):
        """Return the Workload of a Job."""
        assert (resource.api_version, resource.plural) == ("kueue.x-k8s.io/v1beta2", "workloads")
        self.asked.append((namespace, labels))
        if self.refusal is not None:
            raise self.refusal
        return [WAITS]


@pytest.fixture
def server():
    """Return a server that records its requests."""
    return Server()


def job(uid="u", *, suspend=True, labels=QUEUED, status=None):
    """Return a Job that waits in a queue."""
    return {
        "metadata": {"name": "job-0", "namespace": "robots", "uid": uid, "labels": labels},
        "spec": {"suspend": suspend},
        "status": status or {},
    }


def asked(server, *jobs, pods=()):
    """Return the cache, and the reasons that it has after the first wait."""
    admissions = KueueWorkloads(server, lambda: server.now)
    admissions.of(KEY, UID, jobs, pods)
    server.now += PATIENCE_S
    return admissions, admissions.of(KEY, UID, jobs, pods)


def test_the_workload_of_a_job_is_found_by_kueues_label(server):
    """The name of a Workload is a hash, but its label has the uid of the Job."""
    _, answers = asked(server, job())

    assert answers == Answers(facts={"u": SHORT}, again_s=RECHECK_S)
    assert server.asked == [("robots", "kueue.x-k8s.io/job-uid=u")]


@pytest.mark.parametrize(
    ("queued", "pods"),
    [
        (job(suspend=False), []),
        (job(labels={}), []),
        (job(labels=None), []),
        (job(status={"conditions": [{"type": "Failed", "status": "True"}]}), []),
        (job(), [{"metadata": {"ownerReferences": [{"uid": "u"}]}, "status": {"phase": "Running"}}]),
    ],
    ids=["admitted", "no queue", "no labels", "ended", "its pod still saves"],
)
def test_nobody_is_asked_about_a_job_that_does_not_wait_in_a_queue(queued, pods, server):
    """Without a waiting Job the operator must not send a request."""
    _, answers = asked(server, queued, pods=pods)

    assert (answers, server.asked) == (Answers(facts={}), [])


@pytest.mark.parametrize("refusal", [Forbidden(403, "Forbidden", "no"), NotFound(404, "NotFound", "no")])
def test_a_refusal_is_no_word_and_no_error(refusal, server):
    """The operator may lack the permission for Workloads, or Kueue may serve another API version."""
    server.refusal = refusal

    _, answers = asked(server, job())

    assert answers == Answers(facts={"u": ""}, again_s=RECHECK_S)


def test_an_api_server_in_trouble_is_asked_again_after_the_pause_and_what_it_said_stays(server):
    """The error fails one reconcile and is logged.

    Until the next request, other reconciles use the last known message.
    """
    admissions, _ = asked(server, job())
    server.refusal = ServerError(500, "InternalError", "conversion webhook failed")
    server.now += RECHECK_S
    with pytest.raises(ServerError):
        admissions.of(KEY, UID, [job()], [])

    answers = admissions.of(KEY, UID, [job()], [])
    assert (answers.facts, answers.again_s) == ({"u": SHORT}, 2 * RECHECK_S)


def test_jobs_in_queues_take_no_place_and_no_turn_from_pods_that_are_refused(server):
    """Thousands of Jobs may wait in queues for days.

    The operator must still read the events about problems of other pods.
    """
    admissions, pod_events = (kind(server, lambda: server.now) for kind in (KueueWorkloads, PodEvents))
    for number in range(REMEMBERED):
        admissions.of(("robots", f"job-{number}"), UID, [job(f"u{number}")], [])
    server.now += PATIENCE_S
    beyond = admissions.of(KEY, UID, [job("beyond")], [])

    refused = pod_events.of(KEY, UID, [job(suspend=False)], [])

    assert beyond.unasked == {"beyond"}
    assert (refused.unasked, refused.again_s) == (frozenset(), PATIENCE_S)


def test_a_job_that_was_admitted_and_taken_back_is_asked_about_anew(server):
    """The old message explained the first wait and may be wrong for the second."""
    admissions, _ = asked(server, job())
    admissions.of(KEY, UID, [job(suspend=False)], [])

    assert admissions.of(KEY, UID, [job()], []) == Answers(facts={}, again_s=PATIENCE_S)
