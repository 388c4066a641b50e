"""Jobs that do not start: each says why, in a reason and with the container's name."""

import pytest

from palaestra_sim.world import builtin
from tests.e2e.askers import IMAGE
from tests.e2e.jobs import WAIT, make_job
from tests.e2e.namespace import LONG_S

pytestmark = pytest.mark.timeout(400)

FOR_JOBS = {"palaestra.dev/for-jobs": "true"}
STUCK = {
    "crashes": {
        "simulator": {"env": [{"name": "PYTHONHOME", "value": "/nowhere"}], "startDeadlineSeconds": 20}
    },
    "no-image": {"simulator": {"image": "nowhere:0", "startDeadlineSeconds": 20}},
    "no-node": {"scheduling": {"nodeSelector": {"palaestra.dev/nowhere": "true"}}},
}
NEVER_UP = {"driver": "command", "image": IMAGE, "command": ["sleep", "3600"], "startDeadlineSeconds": 15}


@pytest.fixture(scope="module")
def stuck(shared):
    """The namespace with jobs that do not start, each for a reason of its own, side by side."""
    for name, spec in STUCK.items():
        shared.apply(make_job(name, script=WAIT, **spec))
    return shared


def world_map(**labels):
    """Return a ConfigMap with the arena in it."""
    return {"metadata": {"name": "arena", "labels": labels}, "data": {"arena.wbt": builtin("arena").decode()}}


@pytest.mark.trains
def test_a_simulator_that_never_comes_up_fails_the_replica_and_is_named(shared, job):
    """Kubernetes sees a sidecar that runs; only trainer and operator know that nobody answers."""
    shared.apply(job("never-up", simulator=NEVER_UP, backoffLimit=0))

    assert shared.wait_for_end("never-up", LONG_S) == "Failed"
    assert shared.replica("never-up")["reason"] == "SimulatorStartDeadline"
    assert "collect-0" in shared.replica("never-up")["message"]


def test_a_sidecar_that_crash_loops_fails_the_replica_and_is_named(stuck):
    """Kubernetes never fails a pod for it, and its main container waits for nobody."""
    assert stuck.wait_for_end("crashes", LONG_S) == "Failed"
    assert stuck.replica("crashes")["reason"] == "SidecarCrashLoop"
    assert "sim-collect-0" in stuck.replica("crashes")["message"]


def test_an_image_that_cannot_be_pulled_is_named_with_its_container(stuck):
    """Told as soon as the kubelet knows it, and the end of the replica after the start deadline."""
    stuck.wait(lambda: stuck.replica("no-image").get("reason") == "ImagePull")

    message = stuck.replica("no-image")["message"]
    assert "sim-collect-0" in message
    assert "nowhere:0" in message
    assert stuck.wait_for_end("no-image", LONG_S) == "Failed"
    assert stuck.replica("no-image")["reason"] == "ImagePull"


def test_a_job_starts_when_its_world_appears(namespace, job):
    """Order of `kubectl apply` does not matter; a ConfigMap that is not for jobs stays closed."""
    source = {"world": {"configMap": {"name": "arena", "key": "arena.wbt"}}}
    namespace.apply(job("waits", simulator=source, script="exit 0"))
    namespace.wait(lambda: namespace.condition("waits", "Accepted").get("reason") == "WorldMissing")
    assert "spec.simulators[0].world.configMap" in namespace.condition("waits", "Accepted")["message"]

    namespace.create("configmaps", world_map())
    namespace.wait(lambda: namespace.condition("waits", "Accepted").get("reason") == "ConfigMapNotForJobs")
    assert namespace.select("jobs", "waits") == []

    namespace.cluster.patch("configmaps", namespace.name, "arena", {"metadata": {"labels": FOR_JOBS}})
    assert namespace.wait_for_end("waits", LONG_S) == "Succeeded"


def test_a_pod_that_no_node_takes_is_told_in_the_scheduler_s_words(stuck):
    """Nothing fails: a node may come."""
    stuck.wait(lambda: stuck.replica("no-node").get("reason") == "Unschedulable")

    assert "node affinity/selector" in stuck.replica("no-node")["message"]
    assert stuck.status("no-node")["phase"] == "Pending"
