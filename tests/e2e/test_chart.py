"""The chart on the real cluster, in the place of what `make e2e` has installed with kubectl, and beside it.

Helm takes that installation over, and it is put back at the end. For a list of namespaces a release of its
own is made, while the operator of the cluster is away.
"""

import json
import os
import shutil
import subprocess

import pytest

from tests.chart.definitions import kinds_of_prometheus
from tests.chart.helm import CHART, ROOT
from tests.chart.modes import MODES, merged
from tests.e2e.jobs import WAIT, make_claim
from tests.e2e.long_run import operators
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM
from tests.e2e.test_operators import KINDS, fingerprint
from tests.e2e.tour import tour

pytestmark = [pytest.mark.changes_the_operator, pytest.mark.timeout(1200)]

WITHIN_S = 600  # for `helm test`, which pulls nothing here
RELEASE = "palaestra"
NOTEBOOKS = "notebooks"
TOKEN = "sesame"  # of the notebook server
# What needs nothing that this cluster lacks: a registry.
EVERYTHING = merged(
    MODES["available"],
    MODES["monitored"],
    MODES["closed"],
    {"operator": {"replicas": 2}, "serviceAccount": {"create": True, "name": OPERATOR}},
    {"tensorboard": {"enabled": True, "existingClaim": "runs"}},
    {"jupyter": {"enabled": True, "tokenSecret": {"name": NOTEBOOKS}}},
)
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


def helm(verb, namespace, *options, chart=CHART):
    """Run Helm for our release on the cluster of $KUBECONFIG; return what it says."""
    chart = [str(chart)] if verb in {"install", "upgrade"} else []
    done = subprocess.run(
        ["helm", verb, RELEASE, *chart, f"--namespace={namespace}", f"--timeout={WITHIN_S}s", *options],
        capture_output=True,
        text=True,
        timeout=WITHIN_S + 60,
        check=False,
        env=dict(os.environ),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def earlier_chart(tmp_path):
    """The chart as an earlier version, whose operator has another image."""
    shutil.copytree(CHART, tmp_path / RELEASE)
    described = tmp_path / RELEASE / "Chart.yaml"
    described.write_text(described.read_text().replace("\nversion: 0.1.0\n", "\nversion: 0.0.9\n"))
    return tmp_path / RELEASE


@pytest.fixture
def taken_over(cluster, earlier_chart):
    """The installation as an earlier release of Helm; put back as kubectl made it."""
    earlier = ("--set=images.operator.tag=next", "--take-ownership", "--force-conflicts", "--wait")
    try:
        helm("install", SYSTEM, *earlier, chart=earlier_chart)
        yield
    finally:
        helm("uninstall", SYSTEM, "--ignore-not-found", "--wait")
        said = cluster.kubectl("apply", "-f", str(ROOT / "manifests" / "install.yaml"))
        assert cluster.get("deployments", SYSTEM, OPERATOR), said
        cluster.rolled_out(SYSTEM, OPERATOR)


@pytest.fixture
def surroundings(cluster):
    """What the chart asks of a cluster for everything that it can bring: Prometheus' kinds, runs, a token."""
    files = kinds_of_prometheus()
    cluster.kubectl("apply", "--server-side", *files)
    cluster.create("persistentvolumeclaims", make_claim("runs", namespace=SYSTEM))
    secret = {"metadata": {"name": NOTEBOOKS, "namespace": SYSTEM}, "stringData": {"token": TOKEN}}
    cluster.create("secrets", {"apiVersion": "v1", "kind": "Secret", **secret})
    yield
    cluster.delete("secrets", SYSTEM, NOTEBOOKS)
    cluster.delete("persistentvolumeclaims", SYSTEM, "runs")
    cluster.kubectl("delete", "--ignore-not-found", *files)


@pytest.fixture
def alone(cluster):
    """The operator of the cluster is away, so that whatever happens another has done."""
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 0}})
    yield
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 1}})
    cluster.rolled_out(SYSTEM, OPERATOR)


def test_an_upgrade_to_everything_touches_no_pod_and_the_end_leaves_the_job(
    surroundings,  # noqa: ARG001 - there before, gone after
    taken_over,  # noqa: ARG001 - is put back
    cluster,
    namespace,
    job,
    tmp_path,
):
    """A release's whole life, from the version before to two operators, with a job running through it."""
    assert image_of(cluster, OPERATOR).endswith(":next")
    namespace.apply(job("stays", script=WAIT))
    namespace.wait_for_pod("stays", LONG_S)
    namespace.wait(lambda: namespace.status("stays").get("phase") == "Running")
    before = {kind: fingerprint(namespace, kind) for kind in KINDS}

    values = tmp_path / "everything.yaml"
    values.write_text(json.dumps(EVERYTHING))
    helm("upgrade", SYSTEM, f"--values={values}", "--force-conflicts", "--wait")  # with kubectl
    assert not image_of(cluster, OPERATOR).endswith(":next")
    assert len(operators(namespace)) == 2
    assert {kind: fingerprint(namespace, kind) for kind in KINDS} == before
    assert "TensorBoard" in page_of(cluster, "palaestra-tensorboard", 6006)
    assert_notebooks_are_served_to_who_has_the_token(cluster)
    assert_the_first_notebook_drives_a_robot(cluster)
    assert helm("test", SYSTEM).count("TEST SUITE:") == 1

    helm("uninstall", SYSTEM, "--wait")
    assert cluster.get("deployments", SYSTEM, OPERATOR) is None
    assert {kind: fingerprint(namespace, kind) for kind in KINDS} == before
    assert namespace.status("stays")["phase"] == "Running"


def image_of(cluster, deployment):
    """Return the image of a Deployment of the release."""
    (container,) = cluster.get("deployments", SYSTEM, deployment)["spec"]["template"]["spec"]["containers"]
    return container["image"]


def page_of(cluster, deployment, port):
    """Return the first page of a server that no other pod reaches, as `kubectl port-forward` would."""
    fetch = (
        f"from urllib.request import urlopen; print(urlopen('http://127.0.0.1:{port}', timeout=30).read())"
    )
    return inside(cluster, deployment, "python3", "-c", fetch)


def inside(cluster, deployment, *command):
    """Return all that a command says in a pod of a Deployment of the release."""
    return cluster.kubectl("exec", "-n", SYSTEM, f"deploy/{deployment}", "--", *command)


def assert_notebooks_are_served_to_who_has_the_token(cluster):
    """Without the token, only the API version, which the kubelet probes, and the login page are served."""

    def codes(token):
        asked = ("/api", "/api/contents", "/lab")
        return json.loads(inside(cluster, "palaestra-jupyter", "python3", "-c", STATUS_CODES, token, *asked))

    for token in ("", "another"):
        assert codes(token) == {"/api": 200, "/api/contents": 403, "/lab": 302}
    assert codes(TOKEN) == {"/api": 200, "/api/contents": 200, "/lab": 200}


def assert_the_first_notebook_drives_a_robot(cluster):
    """With a kernel as the browser's, a simulator and a ROS master, in a pod that may do nothing else."""
    look = (
        "touch /usr/written; ls /var/run/secrets/kubernetes.io; jupyter execute --inplace first-steps.ipynb"
    )
    said = inside(cluster, "palaestra-jupyter", "sh", "-c", f"{look}; cat first-steps.ipynb")

    assert "touch: cannot touch '/usr/written': Read-only file system" in said
    assert "ls: cannot access '/var/run/secrets/kubernetes.io'" in said
    assert "reached after" in said
    assert "image/png" in said
    assert '"name": "stderr"' not in said


def test_an_operator_of_one_namespace_trains_there(alone, namespace):  # noqa: ARG001 - is put back
    """With Roles only, and everything in that namespace."""
    mode = ("--set=crds.install=false", f"--set=watchNamespaces={{{namespace.name}}}")
    helm("install", namespace.name, *mode, "--wait")

    assert f"{namespace.name}/palaestra-test" in helm("test", namespace.name)
    assert namespace.select("trainingjobs") == []
    tour(namespace, namespace.name)  # of which tests/e2e/test_permissions.py finds the rights that were used
    helm("uninstall", namespace.name, "--wait")
