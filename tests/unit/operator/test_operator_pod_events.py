"""The operator requests the events of a Job or a pod only if they may explain a wait or an end."""

import pytest

from palaestra.cluster import NotFound
from palaestra.operator.bounded_cache import LONGEST_PAUSE_S, PATIENCE_S, RECHECK_S, REMEMBERED, Answers
from palaestra.operator.unwatched_facts import ForeignJobs, PodEvents

KEY, UID = ("robots", "job"), "job-uid"
FAILED = {"reason": "FailedCreate", "message": "exceeded quota", "lastTimestamp": "2026-01-31T12:00:00+00:00"}
BEFORE = {**FAILED, "message": "no such class", "lastTimestamp": "2026-01-31T11:00:00Z"}
LAST = {"involvedObject": {"uid": "u"}, **FAILED}


class Server:
    """An API server of Jobs and events, and a clock."""

    def __init__(self):
        self.now, self.asked, self.jobs, self.times = 100.0, 0, {}, []
        self.about = "reason=FailedCreate"

    def list(self, resource, namespace, *, fields):
        """Return the events of the Job."""
        assert (resource.plural, namespace) == ("events", "robots")
        assert fields.startswith("involvedObject.uid=u")
        assert fields.endswith(f",{self.about}")
        self.asked += 1
        self.times.append(self.now)
        return [FAILED, BEFORE, {"reason": "Scheduled"}]

    def get(self, resource, namespace, name):
        """Return a Job."""
        assert (resource.plural, namespace) == ("jobs", "robots")
        self.asked += 1
        if name not in self.jobs:
            raise NotFound(404, "NotFound", name)
        return self.jobs[name]


@pytest.fixture
def server():
    """Return a server that counts its requests."""
    return Server()


def job(**changes):
    """Return a Job that lacks its pod."""
    return {
        "metadata": {"name": "job-0", "namespace": "robots", "uid": "u"},
        "spec": {},
        "status": {},
        **changes,
    }


def pod(phase):
    """Return the pod of the Job."""
    return {
        "metadata": {"uid": "p", "namespace": "robots", "ownerReferences": [{"uid": "u"}]},
        "status": {"phase": phase},
    }


def events(answers):
    """Return the events that the operator has read."""
    return list(answers.facts.values())


def test_a_new_job_is_given_some_seconds(server):
    """Almost every Job gets a pod at once, so the operator waits before it requests events."""
    pod_events = PodEvents(server, lambda: server.now)

    found = pod_events.of(KEY, UID, [job()], [])

    assert (events(found), server.asked) == ([], 0)
    assert found.again_s == PATIENCE_S


def test_after_that_its_events_are_read_now_and_then(server):
    """While its pods change, a job is reconciled many times a second. Not every reconcile may read events."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [job()], [])
    server.now += PATIENCE_S

    first, second = pod_events.of(KEY, UID, [job()], []), pod_events.of(KEY, UID, [job()], [])
    assert first == second
    assert (events(first), first.again_s, server.asked) == ([LAST], RECHECK_S, 1)


def test_the_pauses_grow_to_five_minutes(server):
    """A quota may be used up for a whole night, and frequent requests would not change that."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [job()], [])
    server.now += PATIENCE_S

    pauses = []
    for _ in range(7):
        pauses.append(pod_events.of(KEY, UID, [job()], []).again_s)
        server.now += pauses[-1]

    assert pauses == [15, 30, 60, 120, 240, 300, 300]
    assert server.asked == 7


def look_at(pod_events, number):
    """Return the known events of a Job without a pod; each number is another TrainingJob."""
    name, uid = f"job-{number}", f"u{number}"
    raw = job(metadata={"name": name, "namespace": "robots", "uid": uid})
    return pod_events.of(("robots", name), f"job-{uid}", [raw], [])


def test_at_most_five_events_lists_a_second_are_asked_for_and_everybody_has_a_turn(server):
    """The API server must not be flooded, so the limit holds for all namespaces together.

    A reconcile before its turn sends no request.
    """
    pod_events = PodEvents(server, lambda: server.now)
    due = {number: look_at(pod_events, number).again_s for number in range(1500)}
    looks = 0

    begun = server.now
    due = {number: begun + wait_s for number, wait_s in due.items()}
    while server.asked < 1500:
        number = min(due, key=due.__getitem__)
        server.now = due[number]
        due[number] = server.now + look_at(pod_events, number).again_s
        looks += 1

    busiest = max(sum(at <= each < at + 1 for each in server.times) for at in server.times)
    assert busiest <= 5
    assert {bool(events(look_at(pod_events, number))) for number in range(1500)} == {True}
    assert server.now - begun < 900
    assert looks < 5 * 1500


def test_jobs_beyond_the_bound_are_not_asked_about_and_listed_as_such(server):
    """Jobs that are already in the cache keep their entry, so each of them gets its events."""
    pod_events = PodEvents(server, lambda: server.now)
    for number in range(REMEMBERED):
        look_at(pod_events, number)
    server.now += PATIENCE_S

    beyond = look_at(pod_events, REMEMBERED)
    within = look_at(pod_events, 0)

    assert (events(beyond), {uid for uid, _ in beyond.unasked}) == ([], {f"u{REMEMBERED}"})
    assert beyond.again_s == LONGEST_PAUSE_S
    assert [each["message"] for each in events(within)] == ["exceeded quota"]


def test_a_job_whose_last_pod_has_failed_lacks_one(server):
    """The API server may refuse the second pod although it accepted the first."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [job()], [pod("Failed")])
    server.now += PATIENCE_S

    assert events(pod_events.of(KEY, UID, [job()], [pod("Failed")])) == [LAST]


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
    """If every Job has its pod, the operator must not request events."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, jobs, pods)
    server.now += PATIENCE_S

    assert pod_events.of(KEY, UID, jobs, pods) == Answers(facts={})
    assert server.asked == 0


def waiting_pod(**status):
    """Return a pod that a node has, but that has not started."""
    return {
        "metadata": {"uid": "u", "namespace": "robots"},
        "spec": {"nodeName": "node-1"},
        "status": {"phase": "Pending", **status},
    }


def test_a_pod_that_waits_for_its_volumes_has_its_warnings_read(server):
    """Most volumes are mounted at once, so the operator waits some seconds before it requests events."""
    server.about = "type=Warning"
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [], [waiting_pod()])
    assert server.asked == 0
    server.now += PATIENCE_S

    found = pod_events.of(KEY, UID, [], [waiting_pod()])
    assert (events(found), found.again_s) == ([LAST], RECHECK_S)


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
    """The status of this pod already has the reason."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [], [pod])
    server.now += PATIENCE_S

    assert pod_events.of(KEY, UID, [], [pod]) == Answers(facts={})
    assert server.asked == 0


def test_a_job_that_is_made_again_is_asked_about_anew(server):
    """The events of the earlier job do not apply, even if a restored backup has its old uid."""
    pod_events = PodEvents(server, lambda: server.now)
    pod_events.of(KEY, UID, [job()], [])
    server.now += PATIENCE_S
    assert events(pod_events.of(KEY, UID, [job()], [])) == [LAST]

    assert pod_events.of(KEY, "another", [job()], []) == Answers(facts={}, again_s=PATIENCE_S)


def test_a_stranger_is_looked_at_again_until_it_is_gone(server):
    """The operator does not watch foreign Jobs, so it must read them to see that the name is free."""
    server.jobs["job-0"] = job()
    strangers = ForeignJobs(server, lambda: server.now)
    strangers.meet(KEY, UID, "job-0")
    assert strangers.among(KEY, UID, ()) == [job()]
    del server.jobs["job-0"]

    assert strangers.among(KEY, UID, ()) == [job()], "not asked at every look"
    server.now += RECHECK_S
    assert strangers.among(KEY, UID, ()) == []


def test_who_is_in_the_cache_is_no_stranger(server):
    """The operator's own Job had the name, but the cache got that Job only after the refused creation."""
    server.jobs["job-0"] = job()
    strangers = ForeignJobs(server, lambda: server.now)
    strangers.meet(KEY, UID, "job-0")

    assert strangers.among(KEY, UID, {"job-0"}) == []
    assert strangers.among(KEY, UID, ()) == []


def ended(code, uid="p", created="2026-01-31T12:00:00Z", **status):
    """Return a pod of the Job whose trainer has ended with this exit code."""
    state = {"terminated": {"exitCode": code, "reason": "Error"}}
    raw = pod("Failed")
    raw["metadata"] |= {"uid": uid, "creationTimestamp": created}
    raw["spec"] = {"containers": [{"name": "trainer"}]}
    raw["status"] |= {"containerStatuses": [{"name": "trainer", "state": state}], **status}
    return raw


def asked_about(jobs, pods):
    """Return the uid and the selector of each request for events."""
    pod_events = PodEvents(Server(), lambda: 0.0)
    return {*pod_events.of(KEY, UID, jobs, pods).facts, *pod_events.known(KEY, UID)}


@pytest.mark.parametrize("code", [75, 137, 143])
def test_the_signal_that_ended_the_newest_pod_is_asked_about(code):
    """Only the kubelet's event shows that a failed probe caused the signal."""
    older = ended(code, uid="older", created="2026-01-31T11:00:00Z")

    assert [each for each in asked_about([job()], [ended(code), older]) if each[1] == "reason=Killing"] == [
        ("p", "reason=Killing")
    ]


TAKEN = [{"type": "DisruptionTarget", "status": "True", "reason": "Preempted"}]


@pytest.mark.parametrize(
    ("code", "status"), [(1, {}), (75, {"reason": "Evicted"}), (75, {"conditions": TAKEN})]
)
def test_an_end_that_the_pod_explains_is_not_asked_about(code, status):
    """For each request the API server must list events, so the operator avoids needless ones."""
    assert not [each for each in asked_about([job()], [ended(code, **status)]) if each[0] == "p"]
