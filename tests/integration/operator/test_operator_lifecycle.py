"""A TrainingJob from its creation to its end; the API server is real, and the kubelet simulated."""

import pytest

from palaestra import Client
from palaestra.cluster.resources import CLAIMS, CONFIG_MAPS, JOBS, PODS, TRAINING_JOBS
from palaestra_protocol.pod.status import Termination
from tests.integration.operator.cluster import stranger, world_map, world_of
from tests.waiting import eventually

FOR_JOBS = {"palaestra.dev/for-jobs": "true"}
DONE = Termination(step=20, reason="Completed", success_rate=0.9)


def test_a_job_gets_its_objects_runs_and_succeeds(place, start):
    """A user sees these steps after `kubectl apply` in `kubectl get tj -w`."""
    start()
    place.train(replicas=2)

    pods = place.pods(count=2)
    kinds = sorted(each.split("/")[0] for each in place.children())
    assert kinds == ["ConfigMap"] * 2 + ["Job"] * 2 + ["NetworkPolicy"] + ["PersistentVolumeClaim"] * 2
    for pod in pods:
        place.run(pod)
    eventually(lambda: place.status().get("running") == "2/2")
    for pod in pods:
        place.end(pod, word=DONE)

    status = place.until("Succeeded")
    assert place.condition("Succeeded")["status"] == "True"
    assert status["successRate"] == 0.9
    assert status["step"] == 20
    assert eventually(lambda: {"Accepted", "Succeeded"} <= place.events())  # emitted after the status


@pytest.mark.parametrize("prefix", ["1team"])
def test_a_job_in_a_namespace_that_begins_with_a_digit_runs(place, start):
    """RFC 1123 allows such a namespace, and its name must not make the names of objects invalid."""
    start()
    place.train()
    [pod] = place.pods()

    place.run(pod)

    place.until("Running")


def test_a_replica_that_succeeded_is_not_trained_again_when_its_job_is_deleted(place, start):
    """A user who removes a finished Job does not want to start hours of training."""
    start()
    place.train()
    [pod] = place.pods()
    place.run(pod)
    place.end(pod, word=DONE)
    place.until("Succeeded")

    place.api.delete(JOBS, place.name, "job-0", propagation="Foreground")
    eventually(lambda: place.get(JOBS, "job-0") is None)
    place.train("later")
    place.pods("later")

    assert place.get(JOBS, "job-0") is None


def bound(place):
    """Bind all claims to volumes, as a provisioner does."""
    for claim in place.all(CLAIMS):
        name, bind = claim["metadata"]["name"], {"status": {"phase": "Bound"}}
        place.api.merge(CLAIMS, place.name, name, {"spec": {"volumeName": f"pv-{name}"}})
        place.api.merge(CLAIMS, place.name, name, bind, subresource="status")


def test_a_deleted_job_leaves_its_claim_and_nothing_else(place, start):
    """The claim keeps the results, and owner references delete the rest without a finalizer."""
    start()
    made = place.train()
    place.pods()
    bound(place)

    place.api.delete(TRAINING_JOBS, place.name, "job")
    eventually(lambda: list(map(claim_or_other, place.children())) == ["claim"])

    assert "finalizers" not in made["metadata"]
    assert place.get(TRAINING_JOBS, "job") is None


def test_a_claim_that_was_never_bound_goes_with_its_job(place, start):
    """Such a claim is empty, and claims of jobs that never started would fill the namespace's quota."""
    start()
    place.train("idle", suspend=True, replicas=2)
    place.train()
    eventually(lambda: len(place.all(CLAIMS)) == 3)

    place.api.delete(TRAINING_JOBS, place.name, "idle")

    eventually(lambda: len(place.all(CLAIMS)) == 1)
    assert len(place.all(CLAIMS, "job")) == 1


def test_a_claim_that_was_never_bound_goes_although_its_job_is_made_again(place, start):
    """The name of the claim contains the uid of the deleted job, so no other job can use the claim."""
    place.train(suspend=True)
    first = start()
    eventually(lambda: place.all(CLAIMS))
    [old] = place.all(CLAIMS)
    first.stop()
    place.api.delete(TRAINING_JOBS, place.name, "job", propagation="Foreground")
    eventually(lambda: place.get(TRAINING_JOBS, "job") is None)
    place.train(suspend=True)

    start()

    eventually(
        lambda: [claim["metadata"]["uid"] != old["metadata"]["uid"] for claim in place.all(CLAIMS)] == [True]
    )


def claim_or_other(name):
    """Return `claim` for the name of a claim, and any other name unchanged."""
    return "claim" if name.startswith("PersistentVolumeClaim/") else name


def test_suspending_and_resuming_changes_the_job_and_nothing_else(place, start):
    """A user suspends a job with `kubectl patch`, and all its other objects must stay as they are."""
    start()
    place.train()
    place.pods()
    before = place.children()

    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
    place.until("Suspended")
    assert place.get(JOBS, "job-0")["spec"]["suspend"] is True
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": False}})

    place.pods()
    assert place.children() == before


def test_a_job_is_suspended_once_its_pod_has_ended_and_runs_in_no_dying_pod(place, start):
    """A user's `kubectl wait` must not return too early.

    It must return for Suspended only after the checkpoint is saved, and for Running only after the old pod
    has ended.
    """
    start()
    place.train()
    [pod] = place.pods()
    place.bind(pod)
    place.run(pod)
    place.until("Running")

    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
    eventually(lambda: place.get(PODS, pod["metadata"]["name"])["metadata"].get("deletionTimestamp"))
    eventually(lambda: place.condition("Running").get("reason") == "Suspending")
    assert [place.condition(kind)["status"] for kind in ("Running", "Suspended")] == ["False", "False"]
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": False}})
    eventually(lambda: place.get(JOBS, "job-0")["spec"]["suspend"] is False)
    assert place.condition("Running")["status"] == "False"
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
    place.end(pod, 75)

    place.until("Suspended")
    assert "Disrupted" not in place.events()


def claim(name):
    """Return a claim with the label that allows jobs to use it."""
    spec = {"accessModes": ["ReadWriteOnce"], "resources": {"requests": {"storage": "1Gi"}}}
    metadata = {"name": name, "labels": FOR_JOBS}
    return {"apiVersion": "v1", "kind": "PersistentVolumeClaim", "metadata": metadata, "spec": spec}


def test_a_claim_that_is_for_jobs_no_more_keeps_its_job_suspended(place, start):
    """Running pods may continue, but a resumed job needs a new pod, and this pod must not use the claim."""
    start()
    place.create(CLAIMS, claim("runs"))
    place.train(storage={"existingClaim": "runs"})
    place.pods()
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
    place.until("Suspended")
    place.api.merge(CLAIMS, place.name, "runs", {"metadata": {"labels": None}})

    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": False}})
    eventually(lambda: place.status()["replicas"][0]["reason"] == "ClaimNotForJobs")
    assert place.get(JOBS, "job-0")["spec"]["suspend"] is True
    place.api.merge(CLAIMS, place.name, "runs", {"metadata": {"labels": FOR_JOBS}})

    assert place.pods(deadline_s=60)


def test_a_job_of_another_controller_is_left_alone(place, start):
    """The field `managedBy` names another controller; only that controller may act on the job."""
    start()
    place.train("theirs", managedBy="example.com/other")
    place.train("ours")
    place.pods("ours")

    assert place.children("theirs") == {}
    assert place.status("theirs")["observedGeneration"] == 0


def test_a_missing_world_is_reported_and_the_job_starts_when_it_is_there(place, start):
    """A user may apply the job and the ConfigMap in any order."""
    start()
    place.train(**world_of("world"))
    eventually(lambda: place.condition("Accepted").get("reason") == "WorldMissing")
    assert place.all(JOBS, "job") == []

    place.create(CONFIG_MAPS, world_map())

    assert place.pods()


def test_a_world_without_the_label_for_jobs_is_not_opened(place, start):
    """Without this rule, an author could read any ConfigMap of the namespace through a TrainingJob."""
    start()
    world = world_map()
    del world["metadata"]["labels"]
    place.create(CONFIG_MAPS, world)

    place.train(**world_of("world"))

    eventually(lambda: place.condition("Accepted").get("reason") == "ConfigMapNotForJobs")
    assert place.all(JOBS, "job") == []


def test_a_taken_name_is_reported_and_the_job_starts_when_it_is_free(place, start):
    """The operator must neither use nor change a Job of another owner."""
    start()
    place.create(JOBS, stranger("job-0"))

    place.train()
    eventually(lambda: "NameTaken" in str(place.status()))
    assert place.get(JOBS, "job-0")["metadata"].get("ownerReferences") is None
    assert "Job job-0" not in str([each["message"] for each in place.about() if each["reason"] == "Planned"])
    place.api.delete(JOBS, place.name, "job-0")

    assert place.pods()


def test_ttl_deletes_the_job_and_keeps_the_run(place, start):
    """The TTL is for the object, but a user still needs the results in the claim."""
    start()
    place.train(ttlSecondsAfterFinished=1)
    [pod] = place.pods()
    bound(place)
    place.run(pod)
    place.end(pod, word=DONE)

    eventually(lambda: place.get(TRAINING_JOBS, "job") is None)

    assert len(place.all(CLAIMS, "job")) == 1


def test_a_trained_job_without_its_claim_waits_for_a_person(place, start, control_plane):
    """A new claim would be empty, and training would start again at step 0 unnoticed."""
    start()
    place.train(backoffLimit=0)
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    place.end(pod, 75, Termination(step=20, reason="Interrupted: SIGTERM received"))
    eventually(lambda: place.status().get("step") == 20)
    client = Client(namespace=place.name, kubeconfig=str(control_plane.kubeconfig))
    client.suspend("job")
    place.until("Suspended")
    [claim] = place.all(CLAIMS)
    place.api.delete(CLAIMS, place.name, claim["metadata"]["name"])
    eventually(lambda: place.all(CLAIMS) == [])

    client.resume("job")
    eventually(lambda: place.status()["replicas"][0]["reason"] == "RunLost")
    held = place.all(CLAIMS), place.get(JOBS, "job-0")["spec"]["suspend"]
    client.restart("job")
    place.pods()
    client.close()

    assert held == ([], True)
    assert [each["metadata"]["name"] for each in place.all(CLAIMS)] == [claim["metadata"]["name"]]
    [replica] = place.status()["replicas"]
    assert (replica["lost"]["what"], replica["lost"]["step"]) == ("Claim", 20)
    assert eventually(lambda: {"RunLost", "RunRestarted"} <= place.events())
