"""If another program changes our objects, the operator reports it and leaves the change."""

import pytest

from palaestra.api.reasons import Reason
from palaestra.cluster import connect
from palaestra.cluster.resources import CLAIMS, JOBS, NETWORK_POLICIES, PODS, TRAINING_JOBS
from palaestra.decide import Delete, Discard, SetSuspend, Stop
from palaestra.decide.decision import Basis
from palaestra.operator.executor import Executor
from palaestra.operator.fenced_client import FencedClient
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import ForeignJobs, RejectedCreations
from tests.integration.operator.cluster import stranger
from tests.integration.operator.installed import USER
from tests.waiting import eventually

SUSPEND_SET = "palaestra.dev/suspend-set"
QUEUE = "kueue"  # the field manager, which the API server reads from the User-Agent


def as_kueue(place, control_plane, *, suspend, name="job-0"):
    """Suspend or resume a Job as Kueue does, and return it."""
    api = connect(str(control_plane.kubeconfig))
    obj = {"apiVersion": "batch/v1", "kind": "Job", "spec": {"suspend": suspend}}
    metadata = {"name": name, "namespace": place.name}
    return api.apply({**obj, "metadata": metadata}, manager=QUEUE)


def patches(control_plane, place):
    """Return the number of the operator's successful patches of Jobs in a namespace."""
    wanted = {"resource": "jobs", "namespace": place.name}
    return sum(
        each["verb"] == "patch" and each["user"].get("username") == USER
        and each["responseStatus"]["code"] == 200 and wanted.items() <= each.get("objectRef", {}).items()
        for each in control_plane.audit(place.name)
    )  # fmt: skip


def message(place, name="job"):
    """Return the message in the status of the first replica."""
    replicas = place.status(name).get("replicas") or [{}]
    return replicas[0].get("message", "")


def test_a_job_that_somebody_else_suspends_is_not_fought_over(place, start, control_plane):
    """With manageJobsWithoutQueueName, Kueue suspends the Job again each time the operator resumes it."""
    start()
    place.train()
    place.pods()

    as_kueue(place, control_plane, suspend=True)
    eventually(lambda: message(place).startswith(f"suspended by {QUEUE}, not by spec.suspend"))
    place.train("later")  # when this job has pods, the operator has seen all earlier changes
    place.pods("later")

    assert patches(control_plane, place) == 0
    assert place.get(JOBS, "job-0")["spec"]["suspend"] is True
    assert eventually(lambda: "Suspended" in place.events())


def test_what_the_operator_set_stands_on_the_job_and_its_author_is_heeded(place, start, control_plane):
    """The operator records its last value of `spec.suspend` in an annotation of the Job.

    If the Job has another value, another program suspended the Job. The operator patches the Job only if the
    author of the TrainingJob changes the wanted value.
    """
    start()
    place.train()
    place.pods()
    as_kueue(place, control_plane, suspend=True)
    place.until("Suspended")
    assert place.get(JOBS, "job-0")["metadata"]["annotations"][SUSPEND_SET] == "false"

    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
    eventually(lambda: place.get(JOBS, "job-0")["metadata"]["annotations"][SUSPEND_SET] == "true")
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": False}})

    assert place.pods()
    assert place.get(JOBS, "job-0")["metadata"]["annotations"][SUSPEND_SET] == "false"
    assert patches(control_plane, place) == 2


def test_a_job_without_its_annotation_is_made_as_its_spec_asks_once(place, start, control_plane):
    """The operator sets the missing annotation in its first patch, so it does not undo a later suspension."""
    first = start()
    place.train()
    place.pods()
    first.stop()
    place.api.merge(JOBS, place.name, "job-0", {"metadata": {"annotations": None}})
    as_kueue(place, control_plane, suspend=True)

    start()
    eventually(lambda: place.get(JOBS, "job-0")["spec"]["suspend"] is False)
    as_kueue(place, control_plane, suspend=True)
    eventually(lambda: message(place).startswith(f"suspended by {QUEUE}, "))

    assert patches(control_plane, place) == 1
    assert place.get(JOBS, "job-0")["metadata"]["annotations"][SUSPEND_SET] == "false"


def test_a_job_is_made_again_beside_a_pod_on_a_lost_node(place, start):
    """The new job has a claim of its own, so it need not wait for a kubelet that does not respond."""
    start()
    place.train(replicas=2)
    for pod in place.pods(count=2):
        place.bind(pod)
    place.api.delete(TRAINING_JOBS, place.name, "job")
    eventually(lambda: all("deletionTimestamp" in each["metadata"] for each in place.all(PODS, "job")))

    place.train(replicas=2)

    assert place.pods(count=2)
    assert len(place.all(PODS, "job")) == 4


def test_a_replica_that_waits_for_an_old_pod_on_the_same_claim_says_so(place, start):
    """The user sees which pod on which node must end before the replica can start."""
    start()
    place.create(CLAIMS, shared_claim())
    place.train(storage={"existingClaim": "shared"})
    [old] = place.pods()
    place.bind(old)
    place.api.delete(TRAINING_JOBS, place.name, "job")
    eventually(lambda: all("deletionTimestamp" in each["metadata"] for each in place.all(PODS, "job")))

    place.train(storage={"existingClaim": "shared"})
    eventually(lambda: "OldPodTerminating" in place.events())
    assert old["metadata"]["name"] in message(place)
    assert "node-1" in message(place)
    assert place.get(JOBS, "job-0") is None
    place.end(old, code=75)  # the node is up again, and its kubelet reports the end

    assert place.pods()


def shared_claim():
    """Return a claim with the label that allows jobs to use it."""
    return {
        "apiVersion": "v1",
        "kind": "PersistentVolumeClaim",
        "metadata": {"name": "shared", "labels": {"palaestra.dev/for-jobs": "true"}},
        "spec": {"accessModes": ["ReadWriteMany"], "resources": {"requests": {"storage": "1Gi"}}},
    }


def test_what_was_decided_on_a_cache_that_lags_is_not_done(place, installed):
    """The API server checks the versions on which the operator decided, so that it cannot act on old data.

    After the decision and before the action, the test removes the TTL and changes the Job.
    """
    writer = FencedClient(installed, lambda: True)
    acting = Executor(installed, writer, ForeignJobs(installed), RejectedCreations())
    place.train()
    job = place.create(JOBS, stranger("job-0"))
    basis = Basis(uid=job["metadata"]["uid"], version=job["metadata"]["resourceVersion"])
    stale = place.get(TRAINING_JOBS, "job")
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"ttlSecondsAfterFinished": 1000}})
    place.api.merge(JOBS, place.name, "job-0", {"metadata": {"annotations": {"seen": "true"}}})
    raw = place.get(TRAINING_JOBS, "job")
    decisions = [
        (stale, Delete(name="job", uid=stale["metadata"]["uid"])),
        (raw, Discard(job="job-0", replica=0, basis=basis)),
        (raw, Stop(job="job-0", replica=0, reason=Reason.STALLED, message="it", basis=basis)),
        (raw, SetSuspend(job="job-0", replica=0, suspend=False, basis=basis)),
    ]

    for seen, action in decisions:
        with pytest.raises(Outdated):
            acting.carry_out(seen, (action,))

    assert (
        place.get(TRAINING_JOBS, "job")["metadata"]["resourceVersion"] == raw["metadata"]["resourceVersion"]
    )
    assert place.get(JOBS, "job-0")["spec"]["suspend"] is True
    assert "palaestra.dev/stopped" not in place.get(JOBS, "job-0")["metadata"]["annotations"]


@pytest.mark.parametrize("write", [0, 1, 3])
def test_a_suspended_job_that_is_stopped_is_deleted_and_not_made_again(write, place, start, control_plane):
    """A queue could admit the remaining Job later, and preempt other jobs for it.

    The writes are the operator's mark, the stop of the other Job, the status and the deletion. If `write` is
    0, no operator is killed. For any other number, the operator is killed after that write, and another
    operator continues.
    """
    first = start()
    place.train(replicas=2, activeDeadlineSeconds=6)
    pods = place.pods(count=2)
    as_kueue(place, control_plane, suspend=True)
    place.run(next(pod for pod in pods if pod["metadata"]["labels"]["palaestra.dev/replica"] == "1"))
    eventually(lambda: [each["phase"] for each in place.status()["replicas"]] == ["Suspended", "Running"])
    first.stop()

    mortal = start(dies_after=write or None)
    if write:
        mortal.wait(60)
        start()

    status = place.until("Failed", deadline_s=60)
    eventually(lambda: place.get(JOBS, "job-0") is None)
    assert [each["reason"] for each in status["replicas"]] == ["DeadlineExceeded"] * 2
    assert place.get(JOBS, "job-1")["spec"]["activeDeadlineSeconds"] == 1
    made = {"resource": "jobs", "namespace": place.name, "name": "job-0"}
    verbs = [
        each["verb"]
        for each in control_plane.audit(place.name)
        if made.items() <= each.get("objectRef", {}).items() and each["user"].get("username") == USER
    ]
    assert verbs.count("create") == 1
    # The next operator may still see the Job in its cache after the first operator has deleted it.
    assert 1 <= verbs.count("delete") <= (2 if write else 1)


def test_edits_of_policy_and_job_are_said_once_and_stay(place, start, control_plane):
    """The author must learn of an edit. It may have a reason, so the operator does not undo it."""
    start()
    place.train()
    place.pods()
    [policy] = place.all(NETWORK_POLICIES, "job")

    place.api.merge(NETWORK_POLICIES, place.name, policy["metadata"]["name"], {"spec": {"ingress": None}})
    place.api.merge(JOBS, place.name, "job-0", {"spec": {"parallelism": 0}})
    eventually(lambda: len(edits(place)) == 2)
    start()  # a second operator, which sees the same edits
    place.train("later")
    place.pods("later")

    assert [each["count"] for each in edits(place)] == [1, 1]
    assert place.get(JOBS, "job-0")["spec"]["parallelism"] == 0
    assert patches(control_plane, place) == 0


def edits(place):
    """Return the events about edits of our objects."""
    return [each for each in place.about() if each["reason"] == "Edited"]
