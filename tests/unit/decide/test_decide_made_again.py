"""A user creates a TrainingJob again under its old name while a pod of the old job still terminates."""

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide import Create

SHARED = {"storage": {"existingClaim": "shared"}}
CLAIM = {"kind": "PersistentVolumeClaim", "metadata": {"labels": {"palaestra.dev/for-jobs": "true"}}}


def made_again(make_scene, *, replica=0, **spec):
    """Return a job without objects; a pod of its predecessor is still on a lost node."""
    scene = make_scene(**spec)
    scene.there[("PersistentVolumeClaim", "shared")] = CLAIM
    old = make_scene(**spec)
    old.there = scene.there
    old.raw["metadata"]["uid"] = "11111111-7c2b-4d68-9a40-c3b2a1908f7e"
    old.settle()
    pod = old.running_pod(replica)
    pod["metadata"]["deletionTimestamp"] = scene.stamp()
    scene.objects["pods"].append(pod)
    return scene, pod


def jobs(decision):
    """Return the names of the Jobs that are created."""
    made = [each.object for each in decision.actions if isinstance(each, Create)]
    return [each["metadata"]["name"] for each in made if each["kind"] == "Job"]


def test_a_pod_of_an_earlier_job_holds_up_nothing(make_scene):
    """A claim's name contains the uid of its job, so the two jobs never write to one volume."""
    scene, _ = made_again(make_scene, replicas=2)

    assert jobs(scene.settle()) == ["job-0", "job-1"]


def test_a_pod_on_the_claim_that_both_name_holds_up_its_own_replica_only(make_scene):
    """Two pods of one replica number would write to one run directory.

    The other replicas have their own directories.
    """
    scene, _ = made_again(make_scene, replicas=2, **SHARED)

    assert jobs(scene.settle()) == ["job-1"]


def test_a_replica_that_waits_for_an_old_pod_says_so(make_scene):
    """The warning names pod, claim and node, because only a person can repair a lost node."""
    scene, pod = made_again(make_scene, **SHARED)

    decision = scene.settle()

    told = scene.replica()
    assert (told.phase, told.reason) == (Phase.PENDING, Reason.OLD_POD_TERMINATING)
    assert all(word in told.message for word in (pod["metadata"]["name"], "shared", "node-1"))
    warned = [each for each in decision.events if each.reason is Reason.OLD_POD_TERMINATING]
    assert [each.type for each in warned] == ["Warning"]


def test_the_replica_starts_when_the_old_pod_has_ended(make_scene):
    """The replica starts by itself, without an action of the user."""
    scene, pod = made_again(make_scene, **SHARED)
    scene.settle()
    pod["status"]["phase"] = "Failed"

    assert jobs(scene.settle()) == ["job-0"]
