"""A notebook in a pod starts simulators in pods of their own.

The API server is real. A kubelet of the tests runs the pods (tests/pod_runner.py). The notebook is a process
of this machine, which a pod object represents in the API server.
"""

import os
import subprocess
import sys

import pytest

from palaestra.cluster import Resource
from palaestra.cluster.resources import CONFIG_MAPS, JOBS, NETWORK_POLICIES, PODS
from palaestra_sim.world import builtin
from tests.integration.operator.cluster import Place
from tests.pod_runner import PodRunner
from tests.waiting import eventually

QUOTAS = Resource(api_version="v1", kind="ResourceQuota", plural="resourcequotas")
PATIENCE_S = 90.0
NOTEBOOK = "notebook-0"
IMAGE = "registry.example/palaestra-notebook:9"
DRIVE = """
import sys
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.webots import Kubernetes, Webots
webots = Webots({name!r}, {world!r}, launcher=Kubernetes({settings}))
with webots:
    robot = Robotino(webots)
    robot.connect()
    robot.advance()
    print(webots.robot_name, webots.observer.time(), flush=True)
if sys.stdin.readline() == "close\\n":
    robot.close()
    webots.close()
"""
NOTEBOOK_POD = {
    "apiVersion": "v1",
    "kind": "Pod",
    "metadata": {"name": NOTEBOOK, "labels": {"app": "jupyter"}},
    "spec": {
        "containers": [{"name": "jupyter", "image": IMAGE}],
        "imagePullSecrets": [{"name": "pulls"}],
    },
}


class Notebooks(Place):
    """A namespace with the pod of a notebook and a kubelet; `notebook` runs a program in place of that pod.

    Args:
        plane: the control plane.
        api: an administrator's client of the control plane.
        folder: a folder for files of pods.
    """

    def __init__(self, plane, api, folder):
        super().__init__(api, "notebooks")
        self.create(PODS, NOTEBOOK_POD)
        self.kubelet = PodRunner(api, self.name, folder)
        self._started = []
        others = {name: value for name, value in os.environ.items() if not name.startswith("ROS_")}
        self._environment = others | {
            "KUBECONFIG": str(plane.kubeconfig),
            "PALAESTRA_NAMESPACE": self.name,
            "PALAESTRA_POD": NOTEBOOK,
            "ROS_MASTER_URI": "http://127.0.0.1:1",
        }

    def notebook(self, name="robotino", world="arena", settings=""):
        """Return a process that starts a simulator, steps it, waits for a line, and closes it."""
        script = DRIVE.format(name=name, world=str(world), settings=settings)
        pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        process = subprocess.Popen([sys.executable, "-c", script], env=self._environment, text=True, **pipes)
        self._started.append(process)
        return process

    def refusal(self, **options):
        """Return the last line of a notebook whose simulator does not start."""
        _, told = self.notebook(**options).communicate("\n", timeout=PATIENCE_S)
        return told.strip().splitlines()[-1]

    def of_simulators(self, resource):
        """Return all objects of a kind that belong to simulators."""
        return self.api.list(resource, self.name, labels="palaestra.dev/session")

    def close(self):
        """End all processes."""
        for process in self._started:
            process.kill()
            process.communicate()
        self.kubelet.close()


@pytest.fixture
def place(control_plane, installed, tmp_path):
    """Yield a namespace with the pod of a notebook and a kubelet."""
    one = Notebooks(control_plane, installed, tmp_path)
    yield one
    one.close()


def test_a_simulator_starts_in_a_pod_and_closing_leaves_nothing(place, tmp_path):
    """The notebook drives the robot of its own world file, and the NetworkPolicy admits only its pods."""
    world = tmp_path / "rover.wbt"
    world.write_bytes(builtin("arena").replace(b"--name=robotino", b"--name=rover"))
    running = place.notebook("rover", world)
    assert running.stdout.readline() == "rover 0.192\n"
    ((job,), (policy,)) = place.of_simulators(JOBS), place.of_simulators(NETWORK_POLICIES)

    assert running.communicate("close\n", timeout=PATIENCE_S) == ("", "")

    spec = job["spec"]["template"]["spec"]
    assert job["metadata"]["ownerReferences"][0]["name"] == NOTEBOOK
    assert (job["spec"]["activeDeadlineSeconds"], job["spec"]["backoffLimit"]) == (86400, 0)
    assert spec["containers"][0]["image"] == "registry.example/palaestra-stub:9"
    assert spec["initContainers"][0]["image"] == IMAGE
    assert spec["imagePullSecrets"] == [{"name": "pulls"}]
    (rule,) = policy["spec"]["ingress"]
    session = job["metadata"]["labels"]["palaestra.dev/session"]
    assert [each["podSelector"]["matchLabels"] for each in rule["from"]] == [
        {"app": "jupyter"},
        {"palaestra.dev/session": session},
    ]
    for kind in (JOBS, NETWORK_POLICIES, CONFIG_MAPS):
        assert eventually(lambda kind=kind: place.of_simulators(kind) == [], PATIENCE_S)
    assert eventually(lambda: place.kubelet.processes() == [], PATIENCE_S)


def test_a_notebook_that_ends_without_closing_takes_its_simulator_with_it(place):
    """A user rarely closes a facade, and the pod should not wait until its `silence_s` has passed."""
    running = place.notebook()
    assert running.stdout.readline() == "robotino 0.192\n"

    running.communicate("end\n", timeout=PATIENCE_S)

    assert eventually(lambda: place.of_simulators(JOBS) == [], PATIENCE_S)


def test_a_notebook_without_a_label_is_refused(place):
    """A selector without labels would admit every pod of the namespace."""
    place.api.merge(PODS, place.name, NOTEBOOK, {"metadata": {"labels": None}})

    assert f"pod {NOTEBOOK} has no label, so a NetworkPolicy cannot admit this pod alone" in place.refusal()
    assert place.of_simulators(JOBS) == []


def test_a_killed_notebook_leaves_no_simulator(place):
    """The sidecar ends when it gets no more requests. So the Job ends too, and the cluster deletes it."""
    running = place.notebook(settings="silence_s=10")
    assert running.stdout.readline() == "robotino 0.192\n"

    running.kill()

    assert eventually(lambda: place.of_simulators(JOBS)[0]["status"].get("succeeded") == 1, PATIENCE_S)
    assert place.of_simulators(JOBS)[0]["spec"]["ttlSecondsAfterFinished"] == 60


@pytest.mark.parametrize(
    ("options", "held_up", "line"),
    [
        ({"world": "/no.wbt"}, None, "palaestra-sidecar: --world: /no.wbt: No such file or directory; give"),
        ({}, ("ErrImageNeverPull", "no image"), "container simulator: ErrImageNeverPull: no image"),
        (
            {"settings": "start_s=1"},
            ("ContainerCreating", ""),
            "the pod does not run after 1 s (no events); free",
        ),
    ],
    ids=["a wrong world", "no image", "too slow"],
)
def test_a_pod_that_does_not_run_is_an_error_with_its_reason(place, options, held_up, line):
    """The user reads one line, and nothing is left."""
    place.kubelet.held_up = held_up

    assert line in place.refusal(**options)
    assert place.of_simulators(JOBS) == []


def test_a_quota_that_forbids_the_pod_is_the_error(place):
    """No pod exists then, and only an event of the Job has the reason."""
    quota = {
        "apiVersion": "v1",
        "kind": "ResourceQuota",
        "metadata": {"name": "small"},
        "spec": {"hard": {"requests.memory": "1Mi"}},
    }
    place.create(QUOTAS, quota)
    eventually(lambda: place.get(QUOTAS, "small").get("status", {}).get("hard"))

    assert "exceeded quota: small, requested: requests.memory" in place.refusal()
    assert place.of_simulators(JOBS) == []


def test_a_program_outside_of_the_cluster_is_refused(place):
    """Such a program could not reach its simulator, which nothing would remove after the program's end."""
    place.api.delete(PODS, place.name, NOTEBOOK)
    eventually(lambda: not place.all(PODS))

    last = place.refusal()

    assert f"namespace {place.name} has no pod {NOTEBOOK}, so this program does not run in the" in last
    assert place.of_simulators(JOBS) == []
