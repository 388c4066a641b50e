"""The storage of a replica's run: a claim of its own, an existing claim, or an ephemeral volume.

The module also adds the claim with the initial policy of the run, if the job names such a claim.
"""

from hashlib import sha256
from typing import Any

from palaestra.api.storage import Retain
from palaestra.errors import PlanError
from palaestra.plan.replica import TRAINER, Replica

INITIAL = "initial-policy"
# Provisioners copy the name of a claim into the value of a label or into a cloud's tag. Labels and tags have
# this limit.
LONGEST_NAME = 63
DIGITS = 12  # hexadecimal digits in a shortened name


def claim(replica: Replica) -> dict[str, Any] | None:
    """Return the replica's own PersistentVolumeClaim, or None if the job uses other storage.

    The claim's name depends on the job's uid. So a job that is deleted and created again starts a new run,
    and the old run stays. With `retain: Keep` the claim has no owner, so it outlives the job.
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
        "metadata": replica.metadata(_claim_of(replica), owned=storage.retain is Retain.DELETE),
        "spec": spec,
    }


def run_volume(replica: Replica) -> dict[str, Any]:
    """Return the volume with the run directory."""
    storage = replica.job.spec.storage
    if storage.ephemeral:
        return {"name": "run", "emptyDir": {"sizeLimit": storage.size}}
    name = storage.existing_claim or _claim_of(replica)
    return {"name": "run", "persistentVolumeClaim": {"claimName": name}}


def initial_volume(replica: Replica) -> dict[str, Any] | None:
    """Return the volume with the initial policy; None without a claim, or if the run uses the same claim.

    A pod must not have two volumes of one claim, because some storage drivers then never mount the claim.
    """
    initial = replica.job.spec.trainer.initial_policy
    if initial is None or initial.claim in {None, replica.job.spec.storage.existing_claim}:
        return None
    return {"name": INITIAL, "persistentVolumeClaim": {"claimName": initial.claim}}


def initial_path(replica: Replica) -> str | None:
    """Return the path of the initial policy for the trainer, or None.

    Raises:
        PlanError: the policy is on a claim, and this layout has no claims.
    """
    initial = replica.job.spec.trainer.initial_policy
    if initial is None:
        return None
    if initial.claim is None:
        return initial.path
    places = replica.places(TRAINER)
    if places.initial is None:
        raise PlanError(
            "spec.trainer.initialPolicy.claim: names a claim of a cluster, but this machine has no claims; "
            "remove it, and give the absolute path of a file of this machine"
        )
    return f"{places.volume if initial_volume(replica) is None else places.initial}/{initial.path}"


def claim_name(job: str, index: int, uid: str) -> str:
    """Return the name of a replica's claim: `<job>-<replica>-<uid>`.

    If this name is too long, the job's name is cut, and a hash of the whole name replaces the uid.
    """
    whole = f"{job}-{index}-{uid}"
    if len(whole) <= LONGEST_NAME:
        return whole
    end = f"-{index}-{sha256(whole.encode()).hexdigest()[:DIGITS]}"
    return f"{job[: LONGEST_NAME - len(end)].rstrip('-.')}{end}"


def _claim_of(replica: Replica) -> str:
    return claim_name(replica.job.metadata.name, replica.index, replica.uid)
