"""A namespace with the TrainingJobs of one test: its objects, requests and waits."""

import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import yaml

from tests.e2e.cluster import Cluster, CommandFailed, Object
from tests.waiting import TooLate, eventually

T = TypeVar("T")

OPERATOR = "palaestra-operator"
SYSTEM = "palaestra-system"
RESTRICTED = {"pod-security.kubernetes.io/enforce": "restricted"}
LOOK_EVERY_S = 0.5
# SHORT_S is for waits of 10 s and LONG_S for a tiny training, on a busy machine whose operator is killed
# repeatedly. A pod may wait for five minutes on a slow machine until other tests' pods have left the only
# node.
SHORT_S, LONG_S = 180.0, 900.0
NO_RESTARTS = dict.fromkeys(("trainer", "simulator", "disruption", "suspension", "operator"), 0)
JOB = "palaestra.dev/job"
NAME_BYTES = 40

ASK = """
import sys, urllib.request
print(urllib.request.urlopen(sys.argv[1], timeout=10).read().decode())
"""
ROS_NODES = """
import json, os, xmlrpc.client
master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
_, _, (published, _, services) = master.getSystemState("/e2e")
print(json.dumps(sorted({node for _, nodes in published + services for node in nodes})))
"""


class NeverHeld(AssertionError):
    """A condition did not become true in time."""


class Namespace:
    """A namespace that enforces the *restricted* Pod Security Standard, with all its objects."""

    def __init__(self, cluster: Cluster, name: str, *, there: bool = False) -> None:
        self.cluster = cluster
        self.name = name
        if not there:
            cluster.create("namespaces", {"metadata": {"name": name, "labels": RESTRICTED}})

    def delete(self) -> None:
        """Start to delete the namespace with everything in it."""
        self.cluster.delete("namespaces", None, self.name)

    def apply(self, job: Object) -> Object:
        """Create a TrainingJob, and return it as stored."""
        return self.create("trainingjobs", job)

    def create(self, kind: str, content: Object) -> Object:
        """Create an object in this namespace."""
        metadata = {**content["metadata"], "namespace": self.name}
        return self.cluster.create(kind, {**content, "metadata": metadata})

    def get(self, kind: str, name: str) -> Object | None:
        """Return an object of this namespace, or None."""
        return self.cluster.get(kind, self.name, name)

    def select(self, kind: str, job: str = "") -> list[Object]:
        """Return the objects of a kind: those of one TrainingJob, or all in the namespace."""
        return self.cluster.select(kind, self.name, f"{JOB}={job}" if job else "")

    def patch(self, name: str, **spec: Any) -> Object:
        """Change fields of a TrainingJob's spec."""
        return self.cluster.patch("trainingjobs", self.name, name, {"spec": spec})

    def status(self, name: str) -> Object:
        """Return the status of a TrainingJob, empty before it has one."""
        found = self.get("trainingjobs", name) or {}
        status: Object = found.get("status", {})
        return status

    def replica(self, name: str, index: int = 0) -> Object:
        """Return the status of a replica, or an empty object before the replica exists."""
        replicas = self.status(name).get("replicas", [])
        return next((each for each in replicas if each["index"] == index), {})

    def condition(self, name: str, kind: str) -> Object:
        """Return a condition of a TrainingJob, or an empty object before the condition exists."""
        conditions = self.status(name).get("conditions", [])
        return next((each for each in conditions if each["type"] == kind), {})

    def holds(self, name: str, kind: str) -> bool:
        """Return whether a condition of a TrainingJob is true."""
        return self.condition(name, kind).get("status") == "True"

    def reasons(self, name: str) -> set[str]:
        """Return the reasons of a TrainingJob's true conditions and of its replicas."""
        status = self.status(name)
        conditions = [each for each in status.get("conditions", []) if each["status"] == "True"]
        return {each["reason"] for each in [*conditions, *status.get("replicas", [])] if each.get("reason")}

    def pods(self, name: str, *, live: bool = True) -> list[Object]:
        """Return the running pods of a TrainingJob, oldest first; with `live` False, all pods."""
        found = sorted(self.select("pods", name), key=lambda pod: pod["metadata"]["creationTimestamp"])
        return [pod for pod in found if not live or runs(pod)]

    def pods_made(self, name: str) -> int:
        """Return the number of pods that the Job controller's events report for a TrainingJob's Jobs."""
        made = [
            each
            for each in self.select("events")
            if each["reason"] == "SuccessfulCreate"
            and each["involvedObject"]["kind"] == "Job"
            and each["involvedObject"]["name"].rpartition("-")[0] == name
        ]
        return sum(each.get("count") or 1 for each in made)

    def events(self, name: str, reason: str) -> list[str]:
        """Return the messages of the events about a TrainingJob with a reason."""
        about = {"kind": "TrainingJob", "name": name}
        return [
            each["message"]
            for each in self.select("events")
            if about.items() <= each["involvedObject"].items() and each["reason"] == reason
        ]

    def execute(self, pod: str, *command: str, container: str = "trainer") -> str:
        """Run a command in a container of a pod, and return its standard output."""
        return self.cluster.execute(self.name, pod, container, *command)

    def fetch(self, pod: str, address: str, *, container: str = "trainer") -> str:
        """Return the response that a container of a pod gets from an address."""
        return self.execute(pod, "python3", "-c", ASK, address, container=container)

    def trainer_status(self, pod: str) -> Object:
        """Return the status of a pod's trainer, empty while it does not respond."""
        try:
            status: Object = json.loads(self.fetch(pod, "http://127.0.0.1:9090/status"))
        except CommandFailed:
            return {}
        return status

    def ros_nodes(self, pod: str) -> set[str]:
        """Return the names of the nodes that are registered at a pod's ROS master."""
        return set(json.loads(self.execute(pod, "python3", "-c", ROS_NODES)))

    def in_run(self, pod: str, name: str) -> list[Object]:
        """Return the JSON lines of a file in a pod's run directory."""
        text = self.execute(pod, "bash", "-c", f"cat $PALAESTRA_RUN/{name}")
        return [json.loads(line) for line in text.splitlines()]

    def wait(self, claim: Callable[[], T | None], within_s: float = SHORT_S) -> T:
        """Return the first true value of `claim`.

        Raises:
                NeverHeld: `claim` returned no true value in time.
        """
        try:
            return eventually(claim, within_s, LOOK_EVERY_S)
        except TooLate as late:
            raise NeverHeld(f"not within {within_s:.0f} s: {_source(claim)}") from late

    def wait_for_reason(self, name: str, reason: str, within_s: float = SHORT_S) -> Object:
        """Wait until the only replica has a reason, and return its status."""
        return self.wait(lambda: _if_so(self.replica(name), reason), within_s)

    def wait_for_end(self, name: str, within_s: float = LONG_S) -> str:
        """Wait until a TrainingJob has ended, and return its phase."""
        ends = {"Succeeded", "Failed"}
        return self.wait(lambda: {self.status(name).get("phase", "")} & ends, within_s).pop()

    def wait_for_pod(self, name: str, within_s: float = SHORT_S) -> str:
        """Wait until the trainer in a TrainingJob's only pod runs, and return the pod's name."""
        return self.wait(lambda: next((named(pod) for pod in self.pods(name) if trains(pod)), ""), within_s)

    def wait_for_step(self, name: str, step: int, within_s: float = LONG_S) -> tuple[str, int]:
        """Wait until the only pod's trainer has passed a step; return the pod's name and the current step."""

        def passed() -> tuple[str, int] | None:
            told = {named(pod): self.trainer_status(named(pod)) for pod in self.pods(name) if trains(pod)}
            steps = {pod: status.get("step", 0) for pod, status in told.items()}
            return next(((pod, at) for pod, at in steps.items() if at >= step), None)

        return self.wait(passed, within_s)

    def dump(self) -> str:
        """Return the objects, events and logs in which a person finds the cause of a failed wait."""
        parts = [
            yaml.safe_dump(_plain(self.select("trainingjobs"))),
            yaml.safe_dump(_plain(self.select("jobs"))),
            self.cluster.kubectl("get", "pods,pvc,configmaps,networkpolicies", "-o=wide", "-n", self.name),
            self.cluster.kubectl("get", "events", "--sort-by=.lastTimestamp", "-n", self.name),
        ]
        logs = ["logs", "--all-containers", "--prefix", "--ignore-errors", "--tail=25"]
        parts += [self.cluster.kubectl(*logs, "-n", self.name, named(pod)) for pod in self.select("pods")]
        parts += [self.cluster.kubectl("get", "pods", "-n", SYSTEM)]
        parts += [self.cluster.kubectl("logs", f"deploy/{OPERATOR}", "--tail=60", "-n", SYSTEM)]
        return "\n".join(parts)


def unique(text: str) -> str:
    """Return a unique name for a namespace, made from the name of a test."""
    plain = re.sub("[^a-z0-9]+", "-", text.removeprefix("test_").lower())[:NAME_BYTES].strip("-")
    return f"e2e-{plain}-{time.time_ns() // 1_000_000 % 0xFFFFFF:x}"


def named(content: Object) -> str:
    """Return the name of an object."""
    name: str = content["metadata"]["name"]
    return name


def runs(pod: Object) -> bool:
    """Return whether a pod has not ended and is not being deleted."""
    ended = pod["status"].get("phase") in {"Succeeded", "Failed"}
    return not ended and "deletionTimestamp" not in pod["metadata"]


def trains(pod: Object) -> bool:
    """Return whether a pod's trainer container runs."""
    return any("running" in each["state"] for each in pod["status"].get("containerStatuses", []))


def statuses(content: Object) -> list[Object]:
    """Return the statuses of all containers of a pod, in order, or an empty list for another object."""
    status = content.get("status", {})
    return [*status.get("initContainerStatuses", []), *status.get("containerStatuses", [])]


def _if_so(replica: Object, reason: str) -> Object:
    return replica if replica.get("reason") == reason else {}


def _plain(objects: list[Object]) -> list[Object]:
    """Return objects without managed fields and pod templates, which only lengthen the output."""
    for each in objects:
        each["metadata"].pop("managedFields", None)
        each["spec"].pop("template", None)
    return objects


def _source(claim: Callable[[], object]) -> str:
    code = claim.__code__
    line = Path(code.co_filename).read_text().splitlines()[code.co_firstlineno - 1].strip()
    return f"{line} ({Path(code.co_filename).name}:{code.co_firstlineno})"
