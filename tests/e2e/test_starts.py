"""Jobs that do not start: the status of each has a reason, with the container if one is the cause."""

import pytest

from palaestra_sim.world import builtin
from tests.e2e.askers import IMAGE
from tests.e2e.jobs import LITTLE, SMALL, WAIT
from tests.e2e.namespace import LONG_S

pytestmark = [pytest.mark.beside, pytest.mark.timeout(1200)]

FOR_JOBS = {"palaestra.dev/for-jobs": "true"}
CRASHES = {"env": [{"name": "PYTHONHOME", "value": "/nowhere"}]}
NO_IMAGE = {"image": "nowhere:0"}
NOWHERE = {"nodeSelector": {"palaestra.dev/nowhere": "true"}}
NEVER_UP = {
    "driver": "command",
    "image": IMAGE,
    "command": ["sleep", "3600"],
    "startDeadlineSeconds": 15,
    "restart": {"limit": 1},
    "resources": LITTLE,
}


def world_map(**labels):
    """Return a ConfigMap that contains the arena."""
    return {"metadata": {"name": "arena", "labels": labels}, "data": {"arena.wbt": builtin("arena").decode()}}


@pytest.mark.after_the_kills
def test_a_simulator_that_never_comes_up_is_named_and_spends_the_trainers_budget(namespace, job):
    """Kubernetes reports that the sidecar runs.

    Only the trainer and the operator can detect that the simulator does not respond.
    """
    namespace.apply(job("never-up", simulator=NEVER_UP, trainer={"resources": SMALL}, backoffLimit=0))

    assert "collect-0" in namespace.wait_for_reason("never-up", "SimulatorStartDeadline", LONG_S)["message"]
    assert namespace.wait_for_end("never-up", LONG_S) == "Failed"
    assert namespace.replica("never-up")["reason"] == "SimulatorBudgetSpent"


def test_a_sidecar_that_crash_loops_is_named_and_ends_nothing(namespace, job):
    """The kubelet restarts the sidecar, so the operator only reports the problem and counts no failure."""
    namespace.apply(job("crashes", script=WAIT, simulator=CRASHES))

    told = namespace.wait_for_reason("crashes", "SidecarCrashLoop", LONG_S)
    assert "sim-collect-0" in told["message"]
    assert told["phase"] in {"Pending", "Running"}
    assert told["restarts"]["trainer"] == 0


def test_an_image_that_cannot_be_pulled_is_named_and_waited_for(namespace, job):
    """The reason appears at once, but the job waits until its author sets a time limit.

    The test sets the limit after the reason appears, because a busy node reports the failure late.
    """
    namespace.apply(job("no-image", script=WAIT, simulator=NO_IMAGE))

    told = namespace.wait_for_reason("no-image", "ImagePull", LONG_S)
    assert "sim-collect-0" in told["message"]
    assert "nowhere:0" in told["message"]
    assert told["phase"] == "Pending"

    namespace.patch("no-image", startTimeoutSeconds=1)
    assert namespace.wait_for_end("no-image", LONG_S) == "Failed"
    assert namespace.replica("no-image")["reason"] == "ImagePull"


def test_a_job_starts_when_its_world_appears(namespace, job):
    """A user may apply the job before the ConfigMap that contains its world.

    The job must wait until the ConfigMap exists and has the label for jobs.
    """
    source = {"world": {"configMap": {"name": "arena", "key": "arena.wbt"}}}
    namespace.apply(job("waits", simulator=source, script="exit 0"))
    namespace.wait(lambda: namespace.condition("waits", "Accepted").get("reason") == "WorldMissing")
    assert "spec.simulators[0].world.configMap" in namespace.condition("waits", "Accepted")["message"]

    namespace.create("configmaps", world_map())
    namespace.wait(lambda: namespace.condition("waits", "Accepted").get("reason") == "ConfigMapNotForJobs")
    assert namespace.select("jobs", "waits") == []

    namespace.cluster.patch("configmaps", namespace.name, "arena", {"metadata": {"labels": FOR_JOBS}})
    assert namespace.wait_for_end("waits", LONG_S) == "Succeeded"


def test_the_status_of_an_unschedulable_pod_quotes_the_scheduler(namespace, job):
    """The job must wait and not fail, because an administrator may add a node."""
    namespace.apply(job("no-node", script=WAIT, scheduling=NOWHERE))

    told = namespace.wait_for_reason("no-node", "Unschedulable", LONG_S)
    assert "node affinity/selector" in told["message"]
    assert told["phase"] == "Pending"
    assert namespace.status("no-node")["phase"] == "Pending"
