"""Pages that a release of the chart serves to browsers: TensorBoard, and notebooks behind a token."""

import base64
import json

from tests.e2e.cluster import Cluster
from tests.e2e.namespace import SYSTEM
from tests.waiting import eventually

NOTEBOOKS = "palaestra-jupyter"
STATUS_CODES = """
import http.client, json, sys
_, token, *paths = sys.argv
codes = {}
for path in paths:
    server = http.client.HTTPConnection("127.0.0.1", 8888, timeout=30)
    server.request("GET", path, headers={"Authorization": f"token {token}"} if token else {})
    codes[path] = server.getresponse().status
print(json.dumps(codes))
"""

# A simulator for which no node has room, then two others: one has the ROS master of both, the other a world
# file. Then the program kills itself.
SIMULATORS = """
import json, os, pathlib, signal
from palaestra_sim.world import builtin
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.webots import Kubernetes, Webots

def driven(webots):
    with webots:
        robot = Robotino(webots)
        robot.connect()
        before = webots.observer.time()
        robot.advance()
        robot.close()
        return round(webots.observer.time() - before, 6)

try:
    Webots("robotino", "arena", launcher=Kubernetes(resources={"requests": {"cpu": "4000"}}, start_s=10))
except ConfigurationError as error:
    refusal = str(error)
place = Kubernetes(silence_s=10)
first = Webots("robotino", "arena", launcher=place)
world = pathlib.Path("/tmp/own.wbt")
world.write_bytes(builtin("arena"))
second = Webots("robotino", world, launcher=place, driver="mujoco")
periods = [driven(first), driven(second)]
first.close()
periods.append(driven(second))
names = [first.robot_name, second.robot_name]
print(json.dumps({"names": names, "periods": periods, "refusal": refusal}), flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
_OF_NOTEBOOKS = "app.kubernetes.io/component=notebook-simulator"
_ENDS_S = 120
_RUN_S = 240


def page_of(cluster: Cluster, namespace: str, deployment: str, port: int) -> str:
    """Return the first page of a server, requested inside its pod because it listens only there."""
    fetch = (
        f"from urllib.request import urlopen; print(urlopen('http://127.0.0.1:{port}', timeout=30).read())"
    )
    return inside(cluster, namespace, deployment, "python3", "-c", fetch)


def inside(cluster: Cluster, namespace: str, deployment: str, *command: str) -> str:
    """Run a command in a pod of one of the release's Deployments, and return all of its output."""
    return cluster.kubectl("exec", "-n", namespace, f"deploy/{deployment}", "--", *command)


def token_of(cluster: Cluster, secret: str) -> str:
    """Return the token of the notebook server."""
    found = cluster.get("secrets", SYSTEM, secret)
    assert found
    return base64.b64decode(found["data"]["token"]).decode()


def assert_notebooks_are_served_to_who_has_the_token(cluster: Cluster, right: str) -> None:
    """Assert that, without the token, the server serves only the API version and the login page.

    The kubelet's probe requests the API version, so that path needs no token.
    """

    def codes(token: str) -> dict[str, int]:
        asked = ("/api", "/api/contents", "/lab")
        said = inside(cluster, SYSTEM, NOTEBOOKS, "python3", "-c", STATUS_CODES, token, *asked)
        found: dict[str, int] = json.loads(said)
        return found

    for token in ("", "another"):
        assert codes(token) == {"/api": 200, "/api/contents": 403, "/lab": 302}
    assert codes(right) == {"/api": 200, "/api/contents": 200, "/lab": 200}


def assert_the_first_notebook_drives_a_robot(cluster: Cluster) -> None:
    """Assert that the first notebook runs in its pod, and that the pod has no credentials of the cluster."""
    look = "touch /usr/written; ls /var/run/secrets/kubernetes.io; jupyter execute --inplace 1-drive.ipynb"
    said = inside(cluster, SYSTEM, NOTEBOOKS, "sh", "-c", f"{look}; cat 1-drive.ipynb")

    assert "touch: cannot touch '/usr/written': Read-only file system" in said
    assert "ls: cannot access '/var/run/secrets/kubernetes.io'" in said
    assert "of simulated time, cylinders at" in said
    assert "image/png" in said
    assert '"name": "stderr"' not in said


def assert_a_notebook_starts_simulators_in_pods(cluster: Cluster) -> None:
    """Assert that a notebook drives simulators in pods, and that they end with it.

    The network of the tests' own cluster enforces no NetworkPolicies, so a test in tests/integration/webots
    checks the policy.
    """
    run = ("exec", "-n", SYSTEM, f"deploy/{NOTEBOOKS}", "--", "python3", "-c", SIMULATORS)
    said = cluster.kubectl(*run, within_s=_RUN_S)  # the exit code is 137, because the program kills itself
    assert '{"names"' in said, said
    seen = json.loads(next(line for line in said.splitlines() if line.startswith('{"names"')))

    assert seen["names"] == ["robotino", "robotino_2"]
    assert seen["periods"] == [0.192] * 3
    assert "FailedScheduling" in seen["refusal"]

    def ended_jobs() -> bool:
        jobs = cluster.select("jobs", SYSTEM, _OF_NOTEBOOKS)
        return all(job.get("status", {}).get("succeeded") == 1 for job in jobs)

    assert eventually(ended_jobs, _ENDS_S)
