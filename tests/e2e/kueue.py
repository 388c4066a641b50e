"""Kueue in the cluster, installed by the commands of docs/howto/queues.md and removed by them at the end.

The page takes chart and image from a registry. Here Kueue's Go module provides both (tests/cluster/kueue.sh).
The image keeps its registry name, so a cluster that reaches the registry can pull the image as well.
"""

import os
import subprocess
from pathlib import Path
from typing import Any

import yaml

from tests.e2e.cluster import Cluster, Object
from tests.e2e.namespace import LONG_S, Namespace
from tests.pages import blocks

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/howto/queues.md").read_text()
DOING, UNDOING = PAGE.split("## Take it away")
GROUP = "kueue.x-k8s.io"
VERSION = f"{GROUP}/v1beta2"
QUEUE = "trainings"
NAMESPACE = "robots"
TYPED_S = 300
MADE_S = 120

_BESIDE_A_TRAINING = "controllerManager.manager.resources.requests.cpu=50m"  # a small request, for two cores
_FROM_THE_MODULE = """
helm() {
  [[ $2 != palaestra ]] || return 0 # tests/e2e/allowances.py has allowed the class already
  [[ $1 == install ]] || { command helm "$@"; return; }
  command helm "${@/#oci:*/$CHART}" --set "$SETTING"
}
"""


class Kueue:
    """Kueue with the queue and the namespace of the page; commands run in `folder`."""

    def __init__(self, cluster: Cluster, folder: Path) -> None:
        self._cluster = cluster
        self._folder = folder
        self._chart = ""

    def taken(self) -> str:
        """Return the reason why Kueue cannot be installed (Kueue or the namespace already exists), or ""."""
        if self._kinds():
            return "this cluster has a Kueue of its own"
        there = self._cluster.get("namespaces", None, NAMESPACE) is not None
        return f"this cluster has a namespace {NAMESPACE} of its own" if there else ""

    def install(self) -> Namespace:
        """Run the page up to its last section, and return the namespace with the queue."""
        (self._folder / "manifests").symlink_to(ROOT / "manifests")
        made = _said("kueue.sh")
        _said("load.sh", f"{made}/image.tar")
        self._chart = f"{made}/chart"
        for block in blocks(DOING, "sh"):
            typed = self._type("-euc", block)
            assert typed.returncode == 0, typed.stdout + typed.stderr
        return Namespace(self._cluster, NAMESPACE, there=True)

    def remove(self) -> None:
        """Run the page's last section even if its commands fail, and check that no object is left."""
        said = [self._type("-uc", block) for block in blocks(UNDOING, "sh")]
        assert self.taken() == "", "".join(each.stdout + each.stderr for each in said)

    def _kinds(self) -> str:
        return self._cluster.kubectl("api-resources", f"--api-group={GROUP}", "--no-headers")

    def _type(self, how: str, text: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["bash", how, _FROM_THE_MODULE + text],
            cwd=self._folder, env={**os.environ, "CHART": self._chart, "SETTING": _BESIDE_A_TRAINING},
            capture_output=True, text=True, timeout=TYPED_S, check=False,
        )  # fmt: skip


def scheduling(priority: str | None = None) -> Object:
    """Return the `scheduling` field of the page's job with this priority class; None: the job without one."""
    specs: list[Object] = [yaml.safe_load(block).get("spec", {}) for block in blocks(DOING, "yaml")]
    found: list[Object] = [spec["scheduling"] for spec in specs if "scheduling" in spec]
    return next(each for each in found if each.get("priorityClassName") == priority)


def workload(space: Namespace, job: str) -> Object:
    """Return Kueue's Workload for the first replica of a TrainingJob, empty before it exists."""
    found = space.cluster.select("workloads", space.name)
    owners = {each["metadata"]["ownerReferences"][0]["name"]: each for each in found}
    return owners.get(f"{job}-0", {})


def wait_for_words(space: Namespace, job: str, kind: str, told: str) -> str:
    """Wait until a condition of a TrainingJob's Workload contains a text, and return its message."""

    def said() -> str:
        found = words(workload(space, job), kind)
        return found if told in found else ""

    return space.wait(said)


def wait_for_message(space: Namespace, job: str, told: str) -> str:
    """Wait until the status of a TrainingJob's first replica contains a text, and return its message."""
    path = "jsonpath={.status.replicas[0].message}"

    def said() -> str:
        found = space.cluster.kubectl("get", "tj", job, f"--namespace={space.name}", f"--output={path}")
        return found if told in found else ""

    return space.wait(said, LONG_S)


def words(found: Object, kind: str) -> str:
    """Return the message of a Workload's condition, or ""."""
    conditions = found.get("status", {}).get("conditions", [])
    return next((each["message"] for each in conditions if each["type"] == kind), "")


def leave_room_for_one(space: Namespace, job: str) -> None:
    """Lower the quota of the queue to the usage of a TrainingJob, once Kueue has admitted the job."""
    admission = space.wait(lambda: workload(space, job).get("status", {}).get("admission"))
    (pods,) = admission["podSetAssignments"]
    queue = space.cluster.get("clusterqueues", None, QUEUE)
    assert queue
    groups = queue["spec"]["resourceGroups"]
    for resource in groups[0]["flavors"][0]["resources"]:
        resource["nominalQuota"] = pods["resourceUsage"][resource["name"]]
    change_queue(space, resourceGroups=groups)


def change_queue(space: Namespace, **spec: Any) -> None:
    """Change fields of the ClusterQueue, and wait until Kueue has processed the change."""
    changed = space.cluster.patch("clusterqueues", None, QUEUE, {"spec": spec})
    generation = changed["metadata"]["generation"]
    space.wait(lambda: _looked_at(space.cluster.get("clusterqueues", None, QUEUE)) == generation)


def _looked_at(queue: Object | None) -> int | None:
    """Return the generation of a ClusterQueue that Kueue has processed."""
    conditions = queue["status"].get("conditions", []) if queue else []
    return next((each["observedGeneration"] for each in conditions if each["type"] == "Active"), None)


def _said(script: str, *arguments: str) -> str:
    """Run a script of tests/cluster, and return its last line."""
    done = subprocess.run(
        [str(ROOT / "tests" / "cluster" / script), *arguments],
        capture_output=True, text=True, timeout=MADE_S, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout.strip().rpartition("\n")[2]
