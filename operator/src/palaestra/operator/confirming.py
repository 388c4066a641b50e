"""See that the cluster is as it was when something was decided: a cache may lag, a read does not.

What was decided on something else is not done: the next look decides anew. What may change between this and
the write is held by preconditions: the uid and the resourceVersion of the object that is written.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS, PODS, TRAINING_JOBS, of
from palaestra.decide import Action, Create, Replace, Stop
from palaestra.errors import PalaestraError
from palaestra.observe.pods import claims
from palaestra.observe.reading import owners, part
from palaestra.plan.replica import JOB_LABEL, REPLICA_LABEL, UID_LABEL

Object = Mapping[str, Any]


class Outdated(PalaestraError):
    """The cluster is not as it was when this was decided, so it was not done; look again."""


def confirm(api: Api, raw: Object, actions: Sequence[Action]) -> None:
    """See that the TrainingJob is as decided on, and so are the pods before a Job is created or stopped.

    A replica that has ended is never trained again, none ever has two pods, and none that has come up since
    is stopped, or its pod replaced, for what kept it from coming up.

    Raises:
        Outdated: it is not.
    """
    if not actions:
        return
    namespace, name = raw["metadata"]["namespace"], raw["metadata"]["name"]
    try:
        found = api.get(TRAINING_JOBS.only_metadata(), namespace, name)["metadata"]["resourceVersion"]
    except NotFound:
        found = None
    if found != raw["metadata"]["resourceVersion"]:
        raise Outdated(f"TrainingJob {name} is not as in the cache")
    created = (each for each in actions if isinstance(each, Create) and of(each.object) == JOBS)
    begun = {str(each.replica): each.object for each in created}
    stops = [each for each in actions if isinstance(each, Stop | Replace)]
    pods = api.list(PODS, namespace, labels=f"{JOB_LABEL}={name}") if begun or stops else []
    for pod in pods:
        if _occupies(pod, begun) or any(_is_news(pod, stop, raw) for stop in stops):
            raise Outdated(f"pod {pod['metadata']['name']} is not as in the cache")
    there = {pod["metadata"]["uid"] for pod in pods} if stops else set()
    if any(uid not in there for stop in stops for uid, _ in stop.basis.pods):
        raise Outdated(f"a pod of TrainingJob {name} is gone and still in the cache")


def _occupies(pod: Object, jobs: Mapping[str, Object]) -> bool:
    """Return whether a pod may still write to the volume of one of these Jobs, which are by replica.

    A pod of an earlier TrainingJob of the name can do so only on a claim that both mount.
    """
    labels = pod["metadata"]["labels"]
    job = jobs.get(labels.get(REPLICA_LABEL))
    if job is None or (pod.get("status") or {}).get("phase") in {"Succeeded", "Failed"}:
        return False
    own = labels.get(UID_LABEL) == job["metadata"]["labels"][UID_LABEL]
    return own or bool(claims(part(pod, "spec")) & claims(part(job, "spec", "template", "spec")))


def _is_news(pod: Object, stop: Stop | Replace, raw: Object) -> bool:
    """Return whether a pod of the replica to be stopped is new, or another than it was.

    One whose labels somebody has changed is no pod of the replica any more, as `observe` has it: else it
    would keep the replica from being stopped for ever.
    """
    uid, known, labels = pod["metadata"]["uid"], dict(stop.basis.pods), pod["metadata"]["labels"]
    if (labels.get(UID_LABEL), labels.get(REPLICA_LABEL)) != (raw["metadata"]["uid"], str(stop.replica)):
        return False
    if uid in known:
        return known[uid] != str(pod["metadata"]["resourceVersion"])
    return stop.basis.uid in owners(pod)
