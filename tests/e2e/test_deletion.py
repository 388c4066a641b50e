"""What remains after a TrainingJob is deleted, or after objects of a TrainingJob are deleted."""

import pytest

from tests.e2e.jobs import WAIT
from tests.e2e.namespace import LONG_S, named

pytestmark = [pytest.mark.beside, pytest.mark.timeout(1200)]

GONE = ("trainingjobs", "jobs", "pods", "configmaps", "networkpolicies")
NOWHERE = {"nodeSelector": {"palaestra.dev/nowhere": "true"}}


def _pending(namespace, name):
    return namespace.replica(name).get("reason") == "Unschedulable"


def _starting(namespace, name):
    """Return whether a pod exists and its volume is bound; an unbound claim is deleted with its job."""
    claims = namespace.select("persistentvolumeclaims", name)
    bound = [claim["status"].get("phase") == "Bound" for claim in claims]
    return namespace.pods(name) and namespace.status(name).get("phase") and bound == [True]


def _running(namespace, name):
    return namespace.status(name).get("phase") == "Running"


def _suspended(namespace, name):
    return namespace.holds(name, "Suspended") and namespace.select("jobs", name)


def _succeeded(namespace, name):
    return namespace.holds(name, "Succeeded")


def _failed(namespace, name):
    return namespace.holds(name, "Failed")


PHASES = {
    "pending": (_pending, {"script": WAIT, "scheduling": NOWHERE}),
    "starting": (_starting, {"script": WAIT}),
    "running": (_running, {"script": WAIT}),
    "suspended": (_suspended, {"script": WAIT, "suspend": True}),
    "succeeded": (_succeeded, {"script": "exit 0"}),
    "failed": (_failed, {"script": "exit 2"}),
}
UNUSED = {"pending", "suspended"}  # the pods of these jobs got no node, so their claims were never bound


@pytest.mark.parametrize("phase", PHASES)
def test_deleted_while_it_is(phase, namespace, job):
    """Only a volume that a pod has used may remain, and no finalizer may delay the deletion."""
    reached, spec = PHASES[phase]
    uid = namespace.apply(job(phase, **spec))["metadata"]["uid"]
    namespace.wait(lambda: reached(namespace, phase), LONG_S)
    assert "finalizers" not in namespace.get("trainingjobs", phase)["metadata"]

    namespace.cluster.delete("trainingjobs", namespace.name, phase)

    # A pod that receives SIGTERM before its script sets the trap runs for its whole grace period of 60 s.
    namespace.wait(lambda: not any(_left(namespace, kind, phase) for kind in GONE), LONG_S)
    kept = [] if phase in UNUSED else [f"{phase}-0-{uid}"]
    namespace.wait(
        lambda: [named(claim) for claim in namespace.select("persistentvolumeclaims", phase)] == kept, LONG_S
    )


def _left(namespace, kind, name):
    if kind == "trainingjobs":
        return namespace.get(kind, name)
    return namespace.select(kind, name)


def test_a_new_job_of_the_same_name_leaves_the_old_volume_alone(namespace, job):
    """The name of the claim contains the job's uid, so the new job does not resume the old job's run."""
    leaves = "touch /var/lib/palaestra/mark"
    finds = "test -w /var/lib/palaestra && test ! -e /var/lib/palaestra/mark"
    namespace.apply(job("again", script=leaves, backoffLimit=0))
    assert namespace.wait_for_end("again", LONG_S) == "Succeeded"
    (old,) = namespace.select("persistentvolumeclaims", "again")
    namespace.cluster.delete("trainingjobs", namespace.name, "again")
    namespace.wait(lambda: namespace.get("trainingjobs", "again") is None)

    namespace.apply(job("again", script=finds, backoffLimit=0))

    assert namespace.wait_for_end("again", LONG_S) == "Succeeded"
    claims = {named(claim): claim["metadata"]["uid"] for claim in namespace.select("persistentvolumeclaims")}
    assert len(claims) == 2
    assert claims[named(old)] == old["metadata"]["uid"]


def test_a_claim_that_is_not_to_be_kept_goes_with_its_job(namespace, job):
    """With `retain: Delete`, the claim has an owner reference, so the user has no volume to clean up."""
    namespace.apply(job("forgets", script="exit 0", storage={"retain": "Delete"}))
    assert namespace.wait_for_end("forgets", LONG_S) == "Succeeded"
    assert len(namespace.select("persistentvolumeclaims", "forgets")) == 1

    namespace.cluster.delete("trainingjobs", namespace.name, "forgets")

    namespace.wait(lambda: namespace.select("persistentvolumeclaims", "forgets") == [])


def test_a_finished_replica_whose_job_is_deleted_is_not_trained_again(namespace, job):
    """The status is the record of the end, so a deleted Job must not start the training again."""
    namespace.apply(job("done", script="exit 0"))
    assert namespace.wait_for_end("done", LONG_S) == "Succeeded"
    namespace.cluster.delete("jobs", namespace.name, "done-0")
    namespace.wait(lambda: namespace.select("pods", "done") == [] and not namespace.select("jobs", "done"))

    # After this change and the whole life of another job, the operator has certainly reconciled the first
    # job.
    namespace.patch("done", ttlSecondsAfterFinished=100_000)
    namespace.apply(job("later", script="exit 0"))
    assert namespace.wait_for_end("later", LONG_S) == "Succeeded"

    assert namespace.select("jobs", "done") == []
    assert namespace.status("done")["phase"] == "Succeeded"
    assert namespace.pods_made("done") == 1


def test_a_job_is_deleted_when_its_time_is_over(namespace, job):
    """`ttlSecondsAfterFinished` deletes the TrainingJob and all its objects, but the results must remain."""
    namespace.apply(job("short", script="exit 0", ttlSecondsAfterFinished=3))

    namespace.wait(lambda: namespace.get("trainingjobs", "short") is None, LONG_S)

    namespace.wait(lambda: not any(_left(namespace, kind, "short") for kind in GONE))
    assert len(namespace.select("persistentvolumeclaims", "short")) == 1
