"""Check by reads that the cluster has not changed since the decision, because a cache may be behind.

If the cluster has changed, the actions are not executed, and the next reconcile decides again. The cluster
may also change between the read and the write. Then the write fails, because it carries the uid and the
resourceVersion of the object as preconditions.
"""

from collections.abc import Mapping, Sequence

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS, PODS, TRAINING_JOBS, resource_of
from palaestra.decide import Action, Create, Replace, Stop
from palaestra.errors import PalaestraError
from palaestra.objects import Object
from palaestra.observe.json_access import owners, part
from palaestra.observe.pods import claims
from palaestra.plan.replica import JOB_LABEL, REPLICA_LABEL, UID_LABEL


class Outdated(PalaestraError):
    """The cluster has changed since the decision, so the action was not executed; reconcile again."""


def confirm(api: Api, raw: Object, actions: Sequence[Action]) -> None:
    """Check that the TrainingJob is unchanged; before a Job is created or stopped, check its pods too.

    These checks prevent a second training of an ended replica, and a second pod for a replica. If a replica
    has started since the decision, its pod is neither stopped nor replaced, because the cause is gone.

    Raises:
        Outdated: the TrainingJob or a pod has changed.
    """
    if not actions:
        return
    namespace, name = raw["metadata"]["namespace"], raw["metadata"]["name"]
    try:
        found = api.get(TRAINING_JOBS.only_metadata(), namespace, name)["metadata"]["resourceVersion"]
    except NotFound:
        found = None
    if found != raw["metadata"]["resourceVersion"]:
        raise Outdated(f"TrainingJob {name} differs from the cache")
    created = (
        action for action in actions if isinstance(action, Create) and resource_of(action.object) == JOBS
    )
    begun = {str(creation.replica): creation.object for creation in created}
    stops = [action for action in actions if isinstance(action, Stop | Replace)]
    pods = api.list(PODS, namespace, labels=f"{JOB_LABEL}={name}") if begun or stops else []
    for pod in pods:
        if _occupies(pod, begun) or any(_is_news(pod, stop, raw) for stop in stops):
            raise Outdated(f"pod {pod['metadata']['name']} differs from the cache")
    there = {pod["metadata"]["uid"] for pod in pods} if stops else set()
    if any(uid not in there for stop in stops for uid, _ in stop.basis.pods):
        raise Outdated(f"a pod of TrainingJob {name} was deleted but is still in the cache")


def _occupies(pod: Object, jobs: Mapping[str, Object]) -> bool:
    """Return whether a pod may still write to the volume of one of `jobs` (the Jobs by replica).

    A pod of an earlier TrainingJob of the same name can write to this volume only if pod and Job mount
    the same claim.
    """
    labels = pod["metadata"]["labels"]
    job = jobs.get(labels.get(REPLICA_LABEL))
    if job is None or (pod.get("status") or {}).get("phase") in {"Succeeded", "Failed"}:
        return False
    own = labels.get(UID_LABEL) == job["metadata"]["labels"][UID_LABEL]
    return own or bool(claims(part(pod, "spec")) & claims(part(job, "spec", "template", "spec")))


def _is_news(pod: Object, stop: Stop | Replace, raw: Object) -> bool:
    """Return whether a pod is new or has changed, and belongs to the replica to be stopped.

    As in `observe`, a pod with edited labels no longer belongs to the replica. Otherwise such a pod would
    prevent the stop of the replica forever.
    """
    uid, known, labels = pod["metadata"]["uid"], dict(stop.basis.pods), pod["metadata"]["labels"]
    if (labels.get(UID_LABEL), labels.get(REPLICA_LABEL)) != (raw["metadata"]["uid"], str(stop.replica)):
        return False
    if uid in known:
        return known[uid] != str(pod["metadata"]["resourceVersion"])
    return stop.basis.uid in owners(pod)
