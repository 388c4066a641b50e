"""The objects of a simulator in a pod: its Job, its NetworkPolicy and the ConfigMap of its world; pure."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palaestra_trainer.webots.launching.sidecar_command import SIDECAR

CONTROL_PORT = 7100
MASTER_PORT = 11311
NAME_LABEL = "palaestra.dev/simulator"
SESSION_LABEL = "palaestra.dev/session"
WORLDS = "/worlds"
SIMULATOR = "simulator"
MASTER = "ros-master"

_REMOVED_AFTER_S = 60
_TRIES_OF_MASTER = 120
_SCRATCH = "/tmp"
_NO_RIGHTS = {
    "allowPrivilegeEscalation": False,
    "capabilities": {"drop": ["ALL"]},
    "readOnlyRootFilesystem": True,
}

Object = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class PodPlan:
    """The values on which the objects of one simulator depend.

    Attributes:
        name: the name of all objects.
        session: a word that the simulators of this program have in common.
        image: the image of the simulator.
        master_image: the image of a ROS master in the same pod; None if a ROS master already runs.
        master_uri: the URI at which the simulator reaches the ROS master.
        options: the sidecar's options for the simulator.
        world: name and content of a world file that is not in the image.
        notebook: the pod of this program: its metadata and the names of its pull secrets.
        resources: requests and limits of the simulator's container.
        silence_s: see `Kubernetes`.
        lifetime_s: see `Kubernetes`.
    """

    name: str
    session: str
    image: str
    master_image: str | None
    master_uri: str
    options: Sequence[str]
    world: tuple[str, bytes] | None
    notebook: Notebook
    resources: Mapping[str, Any]
    silence_s: int
    lifetime_s: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Notebook:
    """The pod in which this program runs.

    Attributes:
        name: its name.
        uid: its uid.
        labels: its labels.
        address: its IP address.
        image: the image of its first container.
        pull_secrets: the entries of its `imagePullSecrets`.
    """

    name: str
    uid: str
    labels: Mapping[str, str]
    address: str
    image: str
    pull_secrets: Sequence[Mapping[str, str]]

    @classmethod
    def from_pod(cls, pod: Object) -> Notebook:
        """Return the notebook that a pod describes."""
        metadata, spec = pod["metadata"], pod["spec"]
        return cls(
            name=metadata["name"],
            uid=metadata["uid"],
            labels=metadata.get("labels", {}),
            address=pod.get("status", {}).get("podIP", ""),
            image=spec["containers"][0]["image"],
            pull_secrets=spec.get("imagePullSecrets", ()),
        )


def job(plan: PodPlan) -> Object:
    """Return the Job, suspended, so that its pod starts only when its NetworkPolicy exists."""
    owner = {"apiVersion": "v1", "kind": "Pod", "name": plan.notebook.name, "uid": plan.notebook.uid}
    return {
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": {"name": plan.name, "labels": _labels(plan), "ownerReferences": [owner]},
        "spec": {
            "activeDeadlineSeconds": plan.lifetime_s,
            "backoffLimit": 0,
            "suspend": True,
            "ttlSecondsAfterFinished": _REMOVED_AFTER_S,
            "template": {"metadata": {"labels": _labels(plan)}, "spec": _pod(plan)},
        },
    }


def network_policy(plan: PodPlan, owner: Object) -> Object:
    """Return the NetworkPolicy: only this program and its simulators may connect to the pod.

    Args:
        plan: the plan.
        owner: the Job, to which the policy belongs.
    """
    session = {"podSelector": {"matchLabels": {SESSION_LABEL: plan.session}}}
    return {
        "apiVersion": "networking.k8s.io/v1",
        "kind": "NetworkPolicy",
        "metadata": _belonging(plan, owner),
        "spec": {
            "podSelector": {"matchLabels": {NAME_LABEL: plan.name}},
            "policyTypes": ["Ingress", "Egress"],
            "ingress": [
                {"from": [{"podSelector": {"matchLabels": dict(plan.notebook.labels)}}, session]},
            ],
            "egress": [{"to": [session]}],
        },
    }


def world_map(plan: PodPlan, world: tuple[str, bytes], owner: Object) -> Object:
    """Return the ConfigMap with the world file; it belongs to the Job `owner`."""
    name, content = world
    return {
        "apiVersion": "v1",
        "kind": "ConfigMap",
        "metadata": _belonging(plan, owner),
        "binaryData": {name: base64.b64encode(content).decode()},
    }


def _belonging(plan: PodPlan, owner: Object) -> Object:
    reference = {
        "apiVersion": "batch/v1",
        "kind": "Job",
        "name": owner["metadata"]["name"],
        "uid": owner["metadata"]["uid"],
    }
    return {"name": plan.name, "labels": _labels(plan), "ownerReferences": [reference]}


def _labels(plan: PodPlan) -> dict[str, str]:
    return {
        "app.kubernetes.io/name": "palaestra",
        "app.kubernetes.io/component": "notebook-simulator",
        NAME_LABEL: plan.name,
        SESSION_LABEL: plan.session,
    }


def _pod(plan: PodPlan) -> Object:
    volumes: list[Object] = [{"name": "scratch", "emptyDir": {"sizeLimit": "1Gi"}}]
    if plan.world is not None:
        volumes.append({"name": "world", "configMap": {"name": plan.name}})
    return {
        "automountServiceAccountToken": False,
        "enableServiceLinks": False,
        "restartPolicy": "Never",
        "securityContext": {"runAsNonRoot": True, "seccompProfile": {"type": "RuntimeDefault"}},
        "imagePullSecrets": [dict(each) for each in plan.notebook.pull_secrets],
        "initContainers": [_master(plan, plan.master_image)] if plan.master_image else [],
        "containers": [_simulator(plan)],
        "volumes": volumes,
    }


def _master(plan: PodPlan, image: str) -> Object:
    return {
        "name": MASTER,
        "image": image,
        "restartPolicy": "Always",
        "command": ["palaestra-ros-master", f"--listen=0.0.0.0:{MASTER_PORT}"],
        "startupProbe": {
            "tcpSocket": {"port": MASTER_PORT},
            "periodSeconds": 1,
            "failureThreshold": _TRIES_OF_MASTER,
        },
        **_common(plan),
        "resources": {"requests": {"cpu": "50m", "memory": "64Mi"}, "limits": {"memory": "512Mi"}},
    }


def _simulator(plan: PodPlan) -> Object:
    listeners = [
        f"--control=0.0.0.0:{CONTROL_PORT}",
        "--health=127.0.0.1:0",
        "--allow-remote-control",
        f"--until-silent={plan.silence_s}",
    ]
    common = _common(plan)
    if plan.world is not None:
        common["volumeMounts"].append({"name": "world", "mountPath": WORLDS, "readOnly": True})
    return {
        "name": SIMULATOR,
        "image": plan.image,
        "command": [SIDECAR, *plan.options, *listeners],
        "resources": {kind: dict(amounts) for kind, amounts in plan.resources.items()},
        **common,
    }


def _common(plan: PodPlan) -> Object:
    """Return the fields that both containers have."""
    environment: list[Object] = [
        {"name": "ROS_IP", "valueFrom": {"fieldRef": {"fieldPath": "status.podIP"}}},
        {"name": "ROS_MASTER_URI", "value": plan.master_uri},
        {"name": "HOME", "value": _SCRATCH},
    ]
    return {
        "env": environment,
        "securityContext": _NO_RIGHTS,
        "terminationMessagePolicy": "FallbackToLogsOnError",
        "volumeMounts": [{"name": "scratch", "mountPath": _SCRATCH}],
    }
