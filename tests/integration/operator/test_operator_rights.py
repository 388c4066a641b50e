"""The roles of an installation grant exactly the permissions that the operator uses, by the audit log."""

from palaestra.cluster.resources import CONFIG_MAPS, JOBS, PODS, TRAINING_JOBS
from palaestra.observe.jobs import REPLACED
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from palaestra.plan.job import QUEUE_LABEL
from tests.chart.installation import installed
from tests.chart.rights import Right, granted, uses
from tests.integration.operator.cluster import stranger, world_map, world_of
from tests.integration.operator.test_operator_refusals import limited, quota
from tests.waiting import eventually

# The audit log does not show this permission, because the API server checks it during another request. With
# OwnerReferencesPermissionEnforcement, a client needs it to set blockOwnerDeletion for an owner. Without it,
# the operator can create nothing here.
UNSEEN = {Right("palaestra.dev", "trainingjobs/finalizers", "update")}


def used(control_plane):
    """Return the permissions that the requests of the operator needed."""
    asked = uses(control_plane.audit_log.read_text())
    return {use.right for use in asked if (use.namespace, use.account) == (NAMESPACE, NAME)}


def test_every_right_is_used_and_none_is_missing(place, start, control_plane):
    """The test makes the operator do all its work, so a permission that stays unused is not needed."""
    operator = start(elect=True)
    place.create(JOBS, stranger("taken-0"))
    place.create(CONFIG_MAPS, world_map())
    place.train("taken")
    place.train("claimed", storage={"existingClaim": "shared"})
    place.train("mapped", **world_of("world"))
    place.train("brief", ttlSecondsAfterFinished=1, trainer={"algorithm": {"name": "SAC"}})
    stop_suspended(place)
    place.train()
    replace_pod(place)
    for _ in range(2):  # the second operator finds events of the first
        suspend(place, flag=True)
        suspend(place, flag=False)
        operator.stop()
        operator = start(elect=True)
    eventually(lambda: place.get(TRAINING_JOBS, "brief") is None)
    wait_in_queue(place)
    limited(place, quota(pods=True))
    place.train("refused")
    eventually(lambda: "PodsRefused" in place.events("refused"))
    eventually(lambda: Right("kueue.x-k8s.io", "workloads", "list") in used(control_plane))

    allowed = granted(installed(), NAMESPACE, NAME)
    assert {right for right in used(control_plane) if right.resource != "secrets"} == allowed - UNSEEN


def stop_suspended(place):
    """Let a job's deadline pass while one of its Jobs is suspended; the operator deletes that Job."""
    place.train("over", replicas=2, activeDeadlineSeconds=2)
    pods = place.pods("over", count=2)
    place.api.merge(JOBS, place.name, "over-0", {"spec": {"suspend": True}})
    place.run(next(pod for pod in pods if pod["metadata"]["labels"]["palaestra.dev/replica"] == "1"))
    eventually(lambda: place.get(JOBS, "over-0") is None)


def replace_pod(place):
    """Make the operator replace the pod, by the annotation of an operator that was killed."""
    [pod] = place.pods()
    mark = f"1 {pod['metadata']['uid']} Stalled: it stands still"
    place.api.merge(JOBS, place.name, "job-0", {"metadata": {"annotations": {REPLACED: mark}}})
    eventually(lambda: "deletionTimestamp" in place.get(PODS, pod["metadata"]["name"])["metadata"])
    place.take(pod, "EvictionByEvictionAPI", "Eviction API: evicting", phase="Failed")


def wait_in_queue(place):
    """Label a suspended Job with a queue, as Kueue does in a namespace with a default queue.

    Kueue never admits the Job.
    """
    place.train("queued", suspend=True)
    eventually(lambda: place.get(JOBS, "queued-0"))
    place.api.merge(JOBS, place.name, "queued-0", {"metadata": {"labels": {QUEUE_LABEL: "default"}}})


def suspend(place, *, flag):
    """Suspend or resume the TrainingJob, and wait until its Job follows."""
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": flag}})
    eventually(lambda: place.get(JOBS, "job-0")["spec"].get("suspend", False) is flag)
