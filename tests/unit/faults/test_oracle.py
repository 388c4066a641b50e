"""The oracle finds each kind of error in recorded data that contains it."""

from tests.faults.oracle import doubles, orphans

OWNER = "11111111-0000-4000-8000-000000000000"


def pod(uid, phase="Running", job_uid=OWNER):
    """Return a pod of replica 0 of a job."""
    labels = {
        "palaestra.dev/job": "job",
        "palaestra.dev/job-uid": job_uid,
        "palaestra.dev/replica": "0",
    }
    return {"metadata": {"uid": uid, "labels": labels}, "status": {"phase": phase}}


def test_two_pods_of_a_replica_at_one_moment_are_found():
    """Two pods of one replica would write to one volume at the same time."""
    assert doubles([("ADDED", pod("a")), ("ADDED", pod("b"))]) == ["replica job-0 has 2 pods at once"]


def test_a_pod_that_follows_one_that_ended_or_was_deleted_is_none_too_many():
    """Every restart has two pods, one after the other, so the oracle must not report it as an error."""
    ended = [("ADDED", pod("a")), ("MODIFIED", pod("a", "Failed")), ("ADDED", pod("b"))]
    deleted = [("ADDED", pod("a")), ("DELETED", pod("a")), ("ADDED", pod("b"))]

    assert doubles(ended) == []
    assert doubles(deleted) == []


def test_a_job_of_the_same_name_is_another_job():
    """A deleted job and a new job of its name have different replicas."""
    assert doubles([("ADDED", pod("a")), ("ADDED", pod("b", job_uid="other"))]) == []


def test_an_object_whose_owner_is_gone_is_an_orphan():
    """If the garbage collector does not delete such an object, it stays for ever."""
    owned = {"metadata": {"uid": "j", "ownerReferences": [{"uid": OWNER}]}}

    assert orphans({"TrainingJob": {}, "Job": {"job-0": owned}}) == ["Job job-0 is left behind"]
    assert orphans({"TrainingJob": {"job": {"metadata": {"uid": OWNER}}}, "Job": {"job-0": owned}}) == []


def test_an_object_of_a_deleted_job_that_owns_nothing_is_an_orphan():
    """Without an owner reference the garbage collector never deletes the object.

    Only its label names the job.
    """
    labelled = {"metadata": {"uid": "n", "labels": {"palaestra.dev/job-uid": OWNER}}}

    assert orphans({"NetworkPolicy": {"job": labelled}}) == ["NetworkPolicy job is left behind"]


def test_a_claim_outlives_its_job():
    """The claim contains the run directory, which a user may still need."""
    claim = {"metadata": {"uid": "c", "labels": {"palaestra.dev/job-uid": OWNER}}}

    assert orphans({"PersistentVolumeClaim": {"job-0": claim}}) == []


def test_a_pod_that_is_being_deleted_is_left_to_its_kubelet():
    """On a lost node such a pod stays for ever, and the operator cannot delete it."""
    going = pod("a")
    going["metadata"]["deletionTimestamp"] = "2026-01-31T12:00:00Z"

    assert orphans({"Pod": {"job-0#1": going}}) == []
    assert orphans({"Pod": {"job-0#1": pod("a")}}) == ["Pod job-0#1 is left behind"]
