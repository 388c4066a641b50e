"""The pod template of a replica, by the Pod Security Standard *restricted*."""

from collections.abc import Mapping
from typing import Any

from palaestra.plan.claim import INITIAL, initial_volume, run_volume
from palaestra.plan.config_map import config_volume
from palaestra.plan.containers import install_sidecar, ros_master, shared_memory, sidecar, trainer
from palaestra.plan.replica import TRAINER, Replica
from palaestra.plan.resources import twice

UNPRIVILEGED: Mapping[str, Any] = {"runAsNonRoot": True, "seccompProfile": {"type": "RuntimeDefault"}}
# Seconds for the last checkpoint and the shutdown of the simulators. A spot node may stop before this time is
# over.
GRACE_S = 60
SCRATCH_SIZE = "1Gi"
MEMORY_SIZE = "128Mi"


def pod_template(
    replica: Replica, config_map: Mapping[str, Any], worlds: Mapping[str, bytes]
) -> dict[str, Any]:
    """Return the template; `config_map` is the replica's ConfigMap, and `worlds` are the worlds in it."""
    installed = install_sidecar(replica)
    init = [
        *([installed] if installed else []),
        ros_master(replica),
        *(sidecar(replica, simulator, worlds) for simulator in replica.simulators),
    ]
    main = trainer(replica)
    initial = initial_volume(replica)
    return {
        "metadata": _metadata(replica),
        "spec": {
            "restartPolicy": "Never",
            "automountServiceAccountToken": False,
            "enableServiceLinks": False,
            **({} if replica.layout.host_users else {"hostUsers": False}),
            "terminationGracePeriodSeconds": GRACE_S,
            "securityContext": _security(replica.layout.user),
            **_scheduling(replica),
            "initContainers": init,
            "containers": [main],
            "volumes": [
                config_volume(config_map),
                run_volume(replica),
                *([initial] if initial else []),
                *_empty_volumes([*init, main], _sizes(replica, main)),
            ],
        },
    }


def _security(user: int | None) -> dict[str, Any]:
    """Return the security settings of a pod; if `user` is None, the cluster chooses user and groups."""
    fixed = {} if user is None else {"runAsUser": user, "runAsGroup": user}
    group = {} if user is None else {"fsGroup": user}
    return {
        "runAsNonRoot": True,
        **fixed,
        "seccompProfile": UNPRIVILEGED["seccompProfile"],
        **group,
        "fsGroupChangePolicy": "OnRootMismatch",
    }


def _metadata(replica: Replica) -> dict[str, Any]:
    """Return labels and annotations of the pod; labels of the job never replace labels of the operator."""
    scheduling = replica.job.spec.scheduling
    metadata: dict[str, Any] = {"labels": {**scheduling.pod_labels, **replica.labels}}
    if scheduling.pod_annotations:
        metadata["annotations"] = scheduling.pod_annotations
    return metadata


def _scheduling(replica: Replica) -> dict[str, Any]:
    """Return the fields of a pod from the job's `scheduling` and pull secrets."""
    spec, scheduling = replica.job.spec, replica.job.spec.scheduling
    given = scheduling.model_dump(mode="json", by_alias=True, exclude_none=True)
    given["nodeSelector"] = {**replica.layout.node_selector, **scheduling.node_selector}
    taken = ("priorityClassName", "nodeSelector", "tolerations", "affinity", "runtimeClassName")
    fields = {name: given[name] for name in taken if given.get(name)}
    if spec.image_pull_secrets:
        fields["imagePullSecrets"] = [{"name": secret.name} for secret in spec.image_pull_secrets]
    return fields


def _sizes(replica: Replica, main: Mapping[str, Any]) -> dict[str, str]:
    """Return the size of each container's shared memory by the name of its volume.

    For the memory that the trainer shares with its worker processes, the limit is the trainer's memory limit.
    """
    return {
        shared_memory(TRAINER): main["resources"]["limits"]["memory"],
        **{
            shared_memory(simulator.container): twice(MEMORY_SIZE) if simulator.group.standby else MEMORY_SIZE
            for simulator in replica.simulators
        },
    }


def _empty_volumes(containers: list[dict[str, Any]], memory: Mapping[str, str]) -> list[dict[str, Any]]:
    """Return an empty volume for each mount that has no other volume; each container has its own volumes."""
    mounted = {mount["name"] for container in containers for mount in container["volumeMounts"]}
    return [
        {"name": name, "emptyDir": _empty(name, memory)}
        for name in sorted(mounted - {"config", "run", INITIAL})
    ]


def _empty(name: str, memory: Mapping[str, str]) -> dict[str, Any]:
    if name in memory:
        return {"medium": "Memory", "sizeLimit": memory[name]}
    return {"sizeLimit": SCRATCH_SIZE}
