"""Where the run of a replica is kept: a claim of its own, one that was there before, or the pod."""

from typing import Any

from palaestra.api.storage import Retain
from palaestra.plan.replica import Replica


def claim(replica: Replica) -> dict[str, Any] | None:
    """Return the replica's own PersistentVolumeClaim, or None when the job wants none.

    Its name has the job's uid: a job that is deleted and made again starts anew, beside the old run.
    It has no owner, so that it outlives the job, unless the job says `retain: Delete`.
    """
    storage = replica.job.spec.storage
    if storage.ephemeral or storage.existing_claim is not None:
        return None
    spec: dict[str, Any] = {
        "accessModes": ["ReadWriteOnce"],
        "resources": {"requests": {"storage": storage.size}},
    }
    if storage.storage_class_name is not None:
        spec["storageClassName"] = storage.storage_class_name
    return {
        "apiVersion": "v1",
        "kind": "PersistentVolumeClaim",
        "metadata": replica.metadata(_name(replica), owned=storage.retain is Retain.DELETE),
        "spec": spec,
    }


def run_volume(replica: Replica) -> dict[str, Any]:
    """Return the volume on which the run directory lies."""
    storage = replica.job.spec.storage
    if storage.ephemeral:
        return {"name": "run", "emptyDir": {"sizeLimit": storage.size}}
    name = storage.existing_claim or _name(replica)
    return {"name": "run", "persistentVolumeClaim": {"claimName": name}}


def _name(replica: Replica) -> str:
    return f"{replica.name}-{replica.uid}"
