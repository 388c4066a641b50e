"""The record of an attempt after its pod is deleted; the API server is real, and the kubelet simulated."""

import pytest

from palaestra.cluster import Resource
from palaestra.cluster.resources import JOBS, PODS, TRAINING_JOBS
from palaestra.observe.jobs import REPLACED
from palaestra_protocol.pod.status import FaultRecord, Termination
from tests.waiting import eventually

FAULT = FaultRecord(
    time="2026-01-31T11:59:00Z", simulator="collect-0", kind="hung", fact="no answer within 5 s", step=7
)
SPENT = Termination(
    step=20,
    reason="SimulatorBudgetSpent: collect-0: 11 restarts within 600 s",
    attempt=1,
    restarts=10,
    log=("simulator restarted", "budget spent"),
    faults=(FAULT,),
)
BUDGETS = Resource(api_version="policy/v1", kind="PodDisruptionBudget", plural="poddisruptionbudgets")
PAUSES = 4
SAVED = Termination(step=20, reason="Interrupted: SIGTERM received", log=("checkpoint written",))


def replica(place):
    """Return the status of the first replica, or an empty object."""
    return next(iter(place.status().get("replicas", ())), {})


def test_the_last_lines_and_faults_stay_when_the_pod_is_gone(place, start, control_plane):
    """A pod's log is deleted with the pod, so a user finds the last lines in `kubectl describe`."""
    start()
    place.train()
    [pod] = place.pods()
    place.run(pod)
    place.end(pod, 80, SPENT)
    place.until("Failed")

    place.api.delete(PODS, place.name, pod["metadata"]["name"])
    eventually(lambda: place.get(PODS, pod["metadata"]["name"]) is None)

    kept = replica(place)["lastAttempt"]
    assert (kept["attempt"], kept["exitCode"], kept["reason"]) == (1, 80, "SimulatorBudgetSpent")
    assert kept["log"] == ["simulator restarted", "budget spent"]
    assert [each["fact"] for each in kept["faults"]] == ["no answer within 5 s"]
    described = control_plane.kubectl("-n", place.name, "describe", "trainingjob", "job").stdout
    assert "Last Attempt:" in described
    assert "budget spent" in described
    assert "no answer within 5 s" in described


def test_suspensions_are_counted_however_fast_they_follow(place, start):
    """Kubernetes stores times in whole seconds, so two suspensions within a second have the same time."""
    start()
    place.train()
    for _ in range(PAUSES):
        [pod] = place.pods()
        eventually(lambda pod=pod: replica(place).get("pod", {}).get("name") == pod["metadata"]["name"])
        place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": True}})
        place.until("Suspended")
        eventually(lambda pod=pod: place.get(PODS, pod["metadata"]["name"]) is None)
        place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": False}})

    eventually(lambda: replica(place).get("attempt") == PAUSES + 1)

    restarts = replica(place)["restarts"]
    assert (restarts["suspension"], restarts["disruption"]) == (PAUSES, 0)


def evict(place, pod):
    """Evict a pod; its trainer saves a checkpoint and exits with 75."""
    place.take(pod, "EvictionByEvictionAPI", "Eviction API: evicting")
    place.end(pod, 75, SAVED)


def lose(place, pod):
    """Delete a pod after its node was deleted, as Kubernetes' garbage collector of pods does."""
    place.take(pod, "DeletionByPodGC", "node not found", phase="Failed")
    place.api.delete(PODS, place.name, pod["metadata"]["name"])


@pytest.mark.parametrize("take", [evict, lose])
def test_a_disruption_is_counted_and_reported_and_is_no_failure(take, place, start):
    """Even if `backoffLimit` is 0, the run must continue in a new pod."""
    start()
    place.train(backoffLimit=0)
    [first] = place.pods()
    place.run(first)
    place.until("Running")

    take(place, first)
    eventually(lambda: replica(place).get("lastAttempt"))
    [second] = eventually(lambda: others(place, first))
    place.run(second)
    eventually(lambda: replica(place).get("attempt") == 2)

    told = replica(place)
    assert told["lastAttempt"]["reason"] == "Disrupted"
    assert (told["restarts"]["disruption"], told["restarts"]["trainer"]) == (1, 0)
    eventually(lambda: "Disrupted" in place.events())
    assert [each["count"] for each in place.about() if each["reason"] == "Disrupted"] == [1]


def others(place, pod):
    """Return the pods that have not ended, except the given pod."""
    return [each for each in place.pods() if each["metadata"]["uid"] != pod["metadata"]["uid"]]


def test_a_simulator_that_was_killed_for_its_memory_is_reported_with_its_limit(place, start):
    """The container restarts at once, so without a report the kill would look like a crash."""
    start()
    group = {"name": "collect", "role": "Collect", "resources": {"limits": {"memory": "512Mi"}}}
    place.train(simulators=[group, {"name": "evaluate", "role": "Evaluate"}])
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")

    place.kill(pod, "sim-collect-0")

    [kills] = eventually(lambda: replica(place).get("memoryKills"))
    assert (kills["container"], kills["times"], kills["limit"]) == ("sim-collect-0", 1, "512Mi")
    eventually(lambda: "SimulatorOutOfMemory" in place.events())
    assert replica(place)["phase"] == "Running"


def test_a_volume_that_cannot_be_mounted_is_reported(place, start):
    """The pod's status shows only that the pod starts, and only an event of the pod contains the cause."""
    start()
    place.train()
    [pod] = place.pods()
    place.bind(pod)
    place.complain(pod, "FailedMount", 'MountVolume.SetUp failed for volume "run": no such file')

    eventually(lambda: replica(place).get("reason") == "VolumeNotMounted")

    assert 'volume "run": no such file' in replica(place)["message"]


def marked(place, pod):
    """Set the annotation that an operator leaves if it is killed before it evicts the pod."""
    mark = f"1 {pod['metadata']['uid']} TrainerNotStarted: the node forgot it"
    place.api.merge(JOBS, place.name, "job-0", {"metadata": {"annotations": {REPLACED: mark}}})


def test_a_pod_that_no_kubelet_heals_is_evicted_and_counted_once(place, start):
    """A new operator finds the annotation of a killed operator and must evict the pod exactly once.

    The eviction is not a failure of the Job.
    """
    operator = start()
    place.train(backoffLimit=0)
    [first] = place.pods()
    operator.stop()
    marked(place, first)
    start()

    eventually(lambda: "deletionTimestamp" in place.get(PODS, first["metadata"]["name"])["metadata"])
    place.take(first, "EvictionByEvictionAPI", "Eviction API: evicting", phase="Failed")
    eventually(lambda: replica(place).get("attempt") == 2)
    [second] = place.pods()

    assert second["metadata"]["uid"] != first["metadata"]["uid"]
    restarts = replica(place)["restarts"]
    assert (restarts["operator"], restarts["disruption"], restarts["trainer"]) == (1, 0, 0)
    assert place.get(JOBS, "job-0").get("status", {}).get("failed", 0) == 0


def test_a_disruption_budget_is_respected_and_reported(place, start):
    """The budget's owner wants the pod to stay, so the operator retries until the budget allows it."""
    start()
    place.train()
    [pod] = place.pods()
    place.bind(pod)
    place.run(pod)
    place.until("Running")
    labels = {"matchLabels": {"palaestra.dev/job": "job"}}
    budget = {
        "metadata": {"name": "stay", "namespace": place.name},
        "spec": {"minAvailable": 1, "selector": labels},
    }
    place.api.create(BUDGETS, {"apiVersion": "policy/v1", "kind": "PodDisruptionBudget", **budget})
    marked(place, pod)

    told = eventually(lambda: "disruption budget" in replica(place).get("message", "") and replica(place))

    assert told["reason"] == "TrainerNotStarted"
    assert place.get(PODS, pod["metadata"]["name"])["metadata"].get("deletionTimestamp") is None
