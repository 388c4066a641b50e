"""The pod that reads the volume of a run after the run's own pod has ended.

This module is pure. The reader pod's spec takes the security context, the scheduling, the pull secrets and
the trainer's image from the pod template of the replica's Job. The reader pod mounts the volume read-only and
has no service account token. Kubernetes ends it at its deadline, even if the client does not delete it.
"""

import copy
from collections.abc import Mapping
from typing import Any

from palaestra.api import TrainingJob
from palaestra.plan.replica import ROS_MASTER, TRAINER, owner

CONTAINER = "reader"
VOLUME = "run"
FETCH_LABEL = "palaestra.dev/fetch"
RUN_VARIABLE = "PALAESTRA_RUN"
GRACE_S = 1


def reading_pod(job: TrainingJob, template: Mapping[str, Any], name: str, lives_s: int) -> dict[str, Any]:
    """Return the pod; the TrainingJob owns it, so that the two are deleted together.

    Args:
        job: the job whose volume the pod mounts.
        template: the pod template of the replica's Job.
        name: name of the pod, different for each call.
        lives_s: whole seconds after which the pod ends by itself.
    """
    spec = copy.deepcopy(dict(template["spec"]))
    spec.pop("initContainers", None)
    spec |= {
        "activeDeadlineSeconds": lives_s,
        "terminationGracePeriodSeconds": GRACE_S,
        "volumes": [volume for volume in spec["volumes"] if volume["name"] == VOLUME],
        "containers": [_reader(template, lives_s)],
    }
    labels = {"app.kubernetes.io/managed-by": "palaestra", FETCH_LABEL: job.metadata.name}
    return {
        "apiVersion": "v1",
        "kind": "Pod",
        "metadata": {
            "name": name,
            "namespace": job.metadata.namespace,
            "labels": labels,
            "ownerReferences": [{**owner(job), "controller": False, "blockOwnerDeletion": False}],
        },
        "spec": spec,
    }


def _reader(template: Mapping[str, Any], lives_s: int) -> dict[str, Any]:
    """Return the container: the trainer's image and security context, with only the run mounted, read-only.

    The container has the resources of the ROS master's container. These resources are small, and the
    namespace's quotas have admitted them before.
    """
    trainer = trainer_of(template)
    [master] = (each for each in template["spec"]["initContainers"] if each["name"] == ROS_MASTER)
    return {
        "name": CONTAINER,
        "image": trainer["image"],
        "imagePullPolicy": trainer["imagePullPolicy"],
        "command": ["sleep", str(lives_s)],
        "securityContext": trainer["securityContext"],
        "resources": master["resources"],
        "volumeMounts": [
            {**mount, "readOnly": True} for mount in trainer["volumeMounts"] if mount["name"] == VOLUME
        ],
    }


def trainer_of(template: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the trainer's container."""
    return next(container for container in template["spec"]["containers"] if container["name"] == TRAINER)


def run_directory(template: Mapping[str, Any]) -> str:
    """Return the path of the run in the trainer's container, which is the same in the reader pod."""
    return next(
        str(variable["value"]) for variable in trainer_of(template)["env"] if variable["name"] == RUN_VARIABLE
    )
