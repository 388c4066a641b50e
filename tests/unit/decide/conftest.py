"""A scene has a TrainingJob, its objects in a fake API server, and clocks that only tests move.

`scene.step()` is one reconcile: it executes the decided actions on the scene's objects, as the operator and
an API server would. With the scene's other methods, a test does what Kubernetes does: it creates pods and
ends Jobs.
"""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from palaestra.api.reasons import Reason
from palaestra.api.status import ReplicaStatus, Status
from palaestra.decide import (
    Create,
    Decision,
    Delete,
    Discard,
    ReconcileRecord,
    Replace,
    Times,
    accept,
    as_data,
    decide,
    prepare,
)
from palaestra.observe import Objects, Polled, observe, references
from palaestra.plan import ClusterLayout, Images, WorldVerdict
from palaestra_protocol.pod.status import SimulatorStatus, Termination, TrainerStatus
from tests.jobs import make_job

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
START = datetime(2026, 1, 31, 12, 0, tzinfo=UTC)
# The world is minimal: no decision depends on its content, and each decision generates the missing worlds.
WORLD = {"inline": '#VRML_SIM R2023b utf8\nRobot { name "robotino" controller "ros" }\n'}
GROUPS = (
    {"name": "collect", "role": "Collect", "world": WORLD},
    {"name": "evaluate", "role": "Evaluate", "world": WORLD},
)
LISTS = {
    "Job": "jobs",
    "ConfigMap": "config_maps",
    "PersistentVolumeClaim": "claims",
    "NetworkPolicy": "policies",
}


class Scene:
    """One TrainingJob `job` and its objects, in memory."""

    def __init__(self, **spec: Any) -> None:
        named = {"namespace": "default", "uid": UID, "generation": 1}
        self.raw = make_job(metadata=named, **{"simulators": GROUPS, **spec})
        self.now = START  # the operator's wall clock, which somebody may set
        self.clock_s = 1000.0  # the operator's monotonic clock
        self.record = ReconcileRecord()
        self.behind_s = 0.0  # delay of the node's clock behind the API server's
        self.server_s = 0.0  # the API server's clock, minus START
        self.layout = ClusterLayout(
            images=Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")
        )
        self.objects: dict[str, list[dict[str, Any]]] = {
            name: [] for name in (*LISTS.values(), "pods", "events")
        }
        self.polled: dict[str, Polled] = {}
        self.there: dict[tuple[str, str], dict[str, Any]] = {}
        self.denied: dict[int | None, str] = {}
        self.kueue = False
        self.verdicts: dict[str, WorldVerdict] | None = None  # None: the plan checks the worlds
        self.switchers: dict[str, str] = {}
        self.unadmitted: dict[str, str] = {}
        self.deleted = False
        self.budget = False  # whether a disruption budget forbids evictions
        self.pods_made = 0

    @property
    def status(self) -> Status:
        """The status that was written last."""
        return accept(self.raw).status

    def replica(self, index: int = 0) -> ReplicaStatus:
        """Return the status of a replica."""
        return self.status.replicas[index]

    def job(self, index: int = 0) -> dict[str, Any]:
        """Return the Job of a replica."""
        return next(each for each in self.objects["jobs"] if each["metadata"]["name"] == f"job-{index}")

    def decide(self) -> Decision:
        """Return the decision on the current state, without executing it."""
        job = accept(deepcopy(self.raw))
        sources = {each: self.there.get((each.kind.value, each.name)) for each in references(job)}
        known = {"polled": self.polled, "denied": self.denied, "switchers": self.switchers}
        objects = Objects(**deepcopy(self.objects), **known, unadmitted=self.unadmitted)
        asked = {"sources": sources, "kueue": self.kueue, "verdicts": self.verdicts}
        observed = replace(observe(job, objects), **asked)
        times = Times(now=self.now, clock_s=self.clock_s, record=self.record)
        return decide(job, observed, prepare(job, observed, self.layout), times)

    def step(self, seconds: float = 0) -> Decision:
        """Let time pass, decide once and execute the decision."""
        self.pass_(seconds)
        decision = self.decide()
        for action in decision.actions:
            self._do(action)
        self.raw["status"] = as_data(decision.status)
        self.record = decision.record
        return decision

    def settle(self, seconds: float = 0) -> Decision:
        """Let time pass, decide until no action is left, and return all decisions as one."""
        all_ = self.step(seconds)
        for _ in range(10):
            before = deepcopy(self.raw["status"])
            again = self.step()
            if not again.actions and self.raw["status"] == before:
                return all_
            all_ = replace(again, actions=all_.actions + again.actions, events=all_.events + again.events)
        raise AssertionError("decides differently each time")

    def pass_(self, seconds: float) -> None:
        """Let time pass."""
        self.now += timedelta(seconds=seconds)
        self.clock_s += seconds
        self.server_s += seconds

    def set_clock(self, seconds: float) -> None:
        """Move the operator's wall clock; no other clock changes."""
        self.now += timedelta(seconds=seconds)

    def restart(self) -> None:
        """Replace the operator's process: the new one has an empty memory and another monotonic clock."""
        self.record, self.clock_s, self.polled = ReconcileRecord(), 5.0, {}

    def stamp(self, seconds: float = 0) -> str:
        """Return a time, by default the current one, in the format of an API server."""
        return (START + timedelta(seconds=self.server_s + seconds)).strftime("%Y-%m-%dT%H:%M:%SZ")

    def node_stamp(self) -> str:
        """Return the current time of the node's clock, as a kubelet or a pod writes it."""
        return self.stamp(-self.behind_s)

    def delete(self, pod: dict[str, Any], grace_s: int = 60) -> None:
        """Delete a pod as a person does; it must be gone after its grace period."""
        pod["metadata"] |= {"deletionTimestamp": self.stamp(grace_s), "deletionGracePeriodSeconds": grace_s}

    def new_pod(self, index: int = 0, uid: str | None = None) -> dict[str, Any]:
        """Create the next pod of a replica, scheduled to a node."""
        number, self.pods_made = self.pods_made, self.pods_made + 1
        template = deepcopy(self.job(index)["spec"]["template"])
        pod = {
            "kind": "Pod",
            "metadata": {
                **template["metadata"],
                "name": f"job-{index}-{number}",
                "uid": uid or f"pod-{number}",
                "creationTimestamp": self.stamp(),
                "ownerReferences": [{"kind": "Job", "uid": self.job(index)["metadata"]["uid"]}],
            },
            "spec": {**template["spec"], "nodeName": "node-1"},
            "status": {"phase": "Pending", "startTime": self.node_stamp()},
        }
        self.objects["pods"].append(pod)
        return pod

    def restarts(self) -> tuple[int, int, int, int]:
        """Return the attempt of replica 0, and its restarts by trainer, disruption and suspension."""
        replica = self.replica()
        counts = replica.restarts
        return replica.attempt, counts.trainer, counts.disruption, counts.suspension

    def running_pod(self, index: int = 0) -> dict[str, Any]:
        """Create the next pod of a replica, with every container running."""
        pod = self.new_pod(index)
        pod["status"] |= {"phase": "Running", "initContainerStatuses": [], "containerStatuses": []}
        for container in pod["spec"]["initContainers"]:
            self.container(pod, container["name"], running=True)
        self.container(pod, "trainer", running=True)
        return pod

    def container(self, pod: dict[str, Any], name: str, **state: Any) -> None:
        """Set the state of a container: running, waiting="Reason: message", code, message and so on."""
        field = "containerStatuses" if name == "trainer" else "initContainerStatuses"
        entry: dict[str, Any] = {"name": name, "restartCount": state.get("restarts", 0), "state": {}}
        ended = {
            "exitCode": state.get("code", 1),
            "reason": state.get("reason", "Error"),
            "message": state.get("message", ""),
            "finishedAt": self.node_stamp(),
        }
        if state.get("running"):
            entry |= {"started": True, "state": {"running": {"startedAt": self.node_stamp()}}}
        elif "waiting" in state:
            reason, _, words = state["waiting"].partition(": ")
            entry["state"] = {"waiting": {"reason": reason, "message": words}}
        else:
            entry["state"] = {"terminated": ended}
        if "code" in state and entry["state"].keys() != {"terminated"}:
            entry["lastState"] = {"terminated": ended}
        others = [each for each in pod["status"].get(field, ()) if each["name"] != name]
        pod["status"][field] = [*others, entry]

    def end(self, pod: dict[str, Any], code: int, message: str = "", **state: Any) -> None:
        """End a pod with its trainer's exit code."""
        self.container(pod, "trainer", code=code, message=message, **state)
        pod["status"]["phase"] = "Failed" if code else "Succeeded"

    def take(self, pod: dict[str, Any], words: str = "preempted") -> None:
        """Let the cluster evict a pod, which interrupts its trainer with exit code 75."""
        self.end(pod, 75)
        pod["status"]["conditions"] = [
            {"type": "DisruptionTarget", "status": "True", "reason": "Preempted", "message": words}
        ]

    def end_job(self, kind: str, index: int = 0, reason: str = "", message: str = "") -> None:
        """Let the Job of a replica end; `kind` is Complete or Failed."""
        self.job(index).setdefault("status", {})["conditions"] = [
            {"type": kind, "status": "True", "reason": reason, "message": message,
             "lastTransitionTime": self.stamp()}
        ]  # fmt: skip

    def count_failures(self, number: int, index: int = 0) -> None:
        """Set the number of failures in the status of a replica's Job."""
        self.job(index).setdefault("status", {})["failed"] = number

    def poll(self, pod: dict[str, Any], **status: Any) -> None:
        """Record a response of a pod's trainer to a poll at the current time."""
        told = {"step": 0, "target": 100, "episodes": 0, "phase": "training", "attempt": 1} | status
        self.polled[pod["metadata"]["uid"]] = Polled(status=TrainerStatus(**told), at_s=self.clock_s)

    def _do(self, action: Any) -> None:
        if isinstance(action, Create):
            created = deepcopy(dict(action.object))
            created["metadata"]["uid"] = f"uid-{created['metadata']['name']}"
            assert created not in self.objects[LISTS[created["kind"]]]
            self.objects[LISTS[created["kind"]]].append(created)
        elif isinstance(action, Delete):
            self.deleted = True
        elif isinstance(action, Discard):
            self.objects["jobs"].remove(next(it for it in self.objects["jobs"] if _name(it) == action.job))
        else:
            _merge(
                next(it for it in self.objects["jobs"] if it["metadata"]["name"] == action.job), action.patch
            )
        if isinstance(action, Replace) and not (self.budget or action.ended):
            self._evict(action.uid)

    def _evict(self, uid: str) -> None:
        pod = next(each for each in self.objects["pods"] if each["metadata"]["uid"] == uid)
        self.delete(pod)
        pod["status"]["conditions"] = [
            {"type": "DisruptionTarget", "status": "True", "reason": "EvictionByEvictionAPI"}
        ]


def _name(obj: dict[str, Any]) -> str:
    return str(obj["metadata"]["name"])


def _merge(target: dict[str, Any], patch: dict[str, Any]) -> None:
    for key, value in patch.items():
        if isinstance(value, dict):
            _merge(target.setdefault(key, {}), value)
        else:
            target[key] = value


@pytest.fixture(scope="session")
def make_scene() -> Callable[..., Scene]:
    """`make_scene(replicas=2)` returns a job that no operator has reconciled.

    The keywords are fields of its spec.
    """
    return Scene


@pytest.fixture(scope="session")
def accepted() -> Callable[..., Scene]:
    """`accepted(replicas=2)` returns a job whose objects exist, without a pod."""

    def make(**spec: Any) -> Scene:
        scene = Scene(**spec)
        scene.settle()
        return scene

    return make


@pytest.fixture(scope="session")
def training() -> Callable[..., tuple[Scene, dict[str, Any]]]:
    """`training()` returns a job that trains in its first pod, and that pod."""

    def make(**spec: Any) -> tuple[Scene, dict[str, Any]]:
        scene = Scene(**spec)
        scene.settle()
        pod = scene.running_pod()
        scene.settle()
        return scene, pod

    return make


@pytest.fixture(scope="session")
def last_word() -> Callable[..., str]:
    """`last_word(step=5)` returns a termination message of a trainer."""

    def write(**word: Any) -> str:
        return Termination(**({"step": 0, "reason": "Unexpected: it"} | word)).to_message()

    return write


@pytest.fixture(scope="session")
def simulator() -> Callable[..., SimulatorStatus]:
    """`simulator(state="failed")` returns the status of collect-0 as a trainer reports it."""

    def make(**told: Any) -> SimulatorStatus:
        return SimulatorStatus(**({"name": "collect-0", "role": "Collect", "state": "ready"} | told))

    return make


@pytest.fixture(scope="session")
def command_groups() -> list[dict[str, Any]]:
    """Return two groups of simulators; the first runs a program of the user's own."""
    own = {"name": "own", "role": "Collect", "driver": "command", "image": "my:1", "command": ["sim"]}
    return [own, {"name": "evaluate", "role": "Evaluate"}]


@pytest.fixture(scope="session")
def reasons() -> Callable[[Decision], list[Reason]]:
    """`reasons(decision)` returns the reasons of its events."""
    return lambda decision: [each.reason for each in decision.events]
