"""A namespace of a control plane without nodes, with methods that act as its kubelet."""

import itertools
import json
import os
from datetime import UTC, datetime
from typing import Any

from palaestra.cluster import Api, NotFound, Resource
from palaestra.cluster.resources import (
    CLAIMS,
    CONFIG_MAPS,
    EVENTS,
    JOBS,
    NAMESPACES,
    NETWORK_POLICIES,
    PODS,
    TRAINING_JOBS,
)
from palaestra_protocol.pod.status import Termination
from palaestra_sim.world import builtin
from tests.jobs import make_job
from tests.waiting import DEADLINE_S, TooLate, eventually

BINDINGS = Resource(api_version="v1", kind="Binding", plural="bindings")
KINDS = (NETWORK_POLICIES, CONFIG_MAPS, CLAIMS, JOBS)

Object = dict[str, Any]
numbers = itertools.count(1)


def served(api: Api) -> bool:
    """Return whether TrainingJobs can be created; discovery may still list a deleted definition."""
    try:
        api.list(TRAINING_JOBS)
    except NotFound:
        return False
    return True


def world_of(config_map: str) -> Object:
    """Return the fields of a job whose only simulator reads its world from a ConfigMap."""
    world = {"configMap": {"name": config_map, "key": "my.wbt"}}
    return {
        "simulators": [{"name": "collect", "role": "Collect", "world": world}],
        "trainer": {"evaluation": {"everySteps": 0}},
    }


def world_map() -> Object:
    """Return a ConfigMap that contains a world and has the label for jobs."""
    return {
        "apiVersion": "v1",
        "kind": "ConfigMap",
        "metadata": {"name": "world", "labels": {"palaestra.dev/for-jobs": "true"}},
        "data": {"my.wbt": builtin("arena").decode()},
    }


def local_queues() -> Object:
    """Return the definition by which the operator detects Kueue; the test acts as Kueue."""
    return kind_of_kueue("LocalQueue", "v1beta1")


def kind_of_kueue(kind: str, version: str) -> Object:
    """Return the definition of a kind of Kueue that accepts any fields."""
    singular = kind.lower()
    names = {"kind": kind, "listKind": f"{kind}List", "plural": f"{singular}s", "singular": singular}
    schema = {"openAPIV3Schema": {"type": "object", "x-kubernetes-preserve-unknown-fields": True}}
    # A definition in a group of a Kubernetes project needs the approval annotation of that project.
    approval = {"api-approved.kubernetes.io": "unapproved, plays Kueue in a test"}
    return {
        "apiVersion": "apiextensions.k8s.io/v1",
        "kind": "CustomResourceDefinition",
        "metadata": {"name": f"{singular}s.kueue.x-k8s.io", "annotations": approval},
        "spec": {
            "group": "kueue.x-k8s.io",
            "names": names,
            "scope": "Namespaced",
            "versions": [{"name": version, "served": True, "storage": True, "schema": schema}],
        },
    }


def stranger(name: str) -> Object:
    """Return a Job that was not created by Palaestra."""
    container = {"name": "main", "image": "theirs", "command": ["true"]}
    template = {"spec": {"restartPolicy": "Never", "containers": [container]}}
    return {
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": {"name": name},
        "spec": {"suspend": True, "template": template},
    }


class Place:
    """A namespace in which a test acts as users and kubelets; `api` is an administrator's client."""

    def __init__(self, api: Api, prefix: str = "place") -> None:
        self.api = api
        self.name = f"{prefix}-{next(numbers)}-{os.getpid()}"
        api.create(NAMESPACES, {"apiVersion": "v1", "kind": "Namespace", "metadata": {"name": self.name}})

    def create(self, resource: Resource, obj: Object) -> Object:
        """Create an object in this namespace."""
        return self.api.create(resource, {**obj, "metadata": {**obj["metadata"], "namespace": self.name}})

    def get(self, resource: Resource, name: str) -> Object | None:
        """Return an object, or None if it does not exist."""
        try:
            return self.api.get(resource, self.name, name)
        except NotFound:
            return None

    def all(self, resource: Resource, job: str | None = None) -> list[Object]:
        """Return all objects of a kind in this namespace, or only those of a TrainingJob."""
        labels = f"palaestra.dev/job={job}" if job else None
        return self.api.list(resource, self.name, labels=labels)

    def train(self, name: str = "job", **spec: Any) -> Object:
        """Create a TrainingJob, as its author does."""
        return self.create(TRAINING_JOBS, make_job(name, **spec))

    def status(self, name: str = "job") -> Object:
        """Return the status of a TrainingJob, or an empty one."""
        return (self.get(TRAINING_JOBS, name) or {}).get("status") or {}

    def condition(self, kind: str, name: str = "job") -> Object:
        """Return a condition of a TrainingJob, or an empty one."""
        conditions = self.status(name).get("conditions", [])
        return next((each for each in conditions if each["type"] == kind), {})

    def children(self, name: str = "job") -> dict[str, str]:
        """Return the uid of every object that was created for a TrainingJob, by kind and name."""
        return {
            f"{resource.kind}/{each['metadata']['name']}": each["metadata"]["uid"]
            for resource in KINDS
            for each in self.all(resource, name)
        }

    def events(self, name: str = "job") -> set[str]:
        """Return the reasons of the events about a TrainingJob."""
        return {each["reason"] for each in self.about(name)}

    def about(self, name: str = "job") -> list[Object]:
        """Return the events about a TrainingJob."""
        found = self.api.list(EVENTS, self.name, fields=f"involvedObject.name={name}")
        return [each for each in found if each["involvedObject"]["kind"] == "TrainingJob"]

    def until(self, phase: str, name: str = "job", deadline_s: float = DEADLINE_S) -> Object:
        """Wait until a TrainingJob is in a phase, and return the status."""
        try:
            eventually(lambda: self.status(name).get("phase") == phase, deadline_s)
        except TooLate as late:
            raise TooLate(f"not {phase} but {json.dumps(self.status(name), indent=1)}") from late
        return self.status(name)

    def pods(self, name: str = "job", count: int = 1, deadline_s: float = DEADLINE_S) -> list[Object]:
        """Wait for this many pods of a TrainingJob that have not ended, and return them."""

        def seen() -> list[Object]:
            alive = [
                each
                for each in self.all(PODS, name)
                if each["status"].get("phase") in {"Pending", "Running"}
                and "deletionTimestamp" not in each["metadata"]
            ]
            return alive if len(alive) >= count else []

        return list(eventually(seen, deadline_s))

    def run(self, pod: Object, address: str = "127.0.0.1") -> None:
        """Set the status of a pod to running, as a kubelet does."""
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        running = {"state": {"running": {"startedAt": now}}, "ready": True, "started": True}
        self._report(pod, "Running", running, podIP=address, podIPs=[{"ip": address}], startTime=now)

    def hold_up(self, pod: Object, reason: str, message: str) -> None:
        """Set the status of a pod whose trainer waits for the kubelet to start it."""
        waiting = {"state": {"waiting": {"reason": reason, "message": message}}, "ready": False}
        trainer = {"name": "trainer", "image": "i", "imageID": "", "restartCount": 0, **waiting}
        self._patch(pod, {"phase": "Pending", "containerStatuses": [trainer]})

    def end(self, pod: Object, code: int = 0, word: Termination | None = None) -> None:
        """Set the status of a pod whose trainer has ended with this exit code and termination message."""
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        reason = "Error" if code else "Completed"
        ended = {"exitCode": code, "startedAt": now, "finishedAt": now, "reason": reason}
        if word is not None:
            ended["message"] = word.to_message()
        done = {"state": {"terminated": ended}, "ready": False, "started": False}
        self._report(pod, "Failed" if code else "Succeeded", done)

    def take(self, pod: Object, reason: str, message: str, **status: Any) -> None:
        """Set the condition of a pod that is about to be removed; keywords are other fields of the status."""
        # Kubernetes removes a disruption condition that is older than two minutes.
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        taken = {"type": "DisruptionTarget", "status": "True", "lastTransitionTime": now}
        taken |= {"reason": reason, "message": message}
        self._patch(pod, {"conditions": [taken], **status})

    def kill(self, pod: Object, container: str) -> None:
        """Set the status of a running pod whose sidecar was killed for its memory and has restarted."""
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        ended = {"exitCode": 137, "reason": "OOMKilled", "startedAt": now, "finishedAt": now}
        status = (self.get(PODS, pod["metadata"]["name"]) or pod)["status"]
        for each in status["initContainerStatuses"]:
            if each["name"] == container:
                each |= {"lastState": {"terminated": ended}, "restartCount": each["restartCount"] + 1}
        self._patch(pod, {"initContainerStatuses": status["initContainerStatuses"]})

    def bind(self, pod: Object, node: str = "node-1") -> None:
        """Bind a pod to a node, as a scheduler does."""
        name = pod["metadata"]["name"]
        target = {"apiVersion": "v1", "kind": "Node", "name": node}
        self.create(
            BINDINGS, {"apiVersion": "v1", "kind": "Binding", "metadata": {"name": name}, "target": target}
        )

    def complain(self, pod: Object, reason: str, message: str) -> None:
        """Create a kubelet's warning event about a pod."""
        metadata = {"name": f"{pod['metadata']['name']}.1", "namespace": self.name}
        about = {
            "apiVersion": "v1",
            "kind": "Pod",
            "namespace": self.name,
            "name": pod["metadata"]["name"],
            "uid": pod["metadata"]["uid"],
        }
        now = f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
        event = {"type": "Warning", "reason": reason, "message": message, "lastTimestamp": now}
        self.create(
            EVENTS,
            {"apiVersion": "v1", "kind": "Event", "metadata": metadata, "involvedObject": about, **event},
        )

    def _report(self, pod: Object, phase: str, state: Object, **more: Any) -> None:
        spec = pod["spec"]
        common = {"image": "i", "imageID": "i", "restartCount": 0}
        status = {
            "phase": phase,
            "initContainerStatuses": [{"name": c["name"], **common, **state} for c in spec["initContainers"]],
            "containerStatuses": [{"name": c["name"], **common, **state} for c in spec["containers"]],
            **more,
        }
        self._patch(pod, status)

    def _patch(self, pod: Object, status: Object) -> None:
        self.api.merge(PODS, self.name, pod["metadata"]["name"], {"status": status}, subresource="status")
