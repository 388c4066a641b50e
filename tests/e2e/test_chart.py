"""The chart on the real cluster, in the place of what `make e2e` has installed with kubectl, and beside it.

Helm takes that installation over, and it is put back at the end. For a list of namespaces a release of its
own is made, while the operator of the cluster is away.
"""

import os
import subprocess

import pytest

from tests.chart.helm import CHART, ROOT
from tests.e2e.jobs import WAIT
from tests.e2e.long_run import operators
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM
from tests.e2e.test_operators import KINDS, fingerprint

pytestmark = [pytest.mark.changes_the_operator, pytest.mark.timeout(1200)]

WITHIN_S = 600  # for `helm test`, which pulls nothing here
RELEASE = "palaestra"


def helm(verb, namespace, *options):
    """Run Helm for our release on the cluster of $KUBECONFIG; return what it says."""
    chart = [str(CHART)] if verb in {"install", "upgrade"} else []
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
def taken_over(cluster):
    """The installation as a release of Helm; put back as kubectl made it."""
    try:
        helm("install", SYSTEM, "--take-ownership", "--wait")
        yield
    finally:
        helm("uninstall", SYSTEM, "--ignore-not-found", "--wait")
        said = cluster.kubectl("apply", "-f", str(ROOT / "manifests" / "install.yaml"))
        assert cluster.get("deployments", SYSTEM, OPERATOR), said
        cluster.rolled_out(SYSTEM, OPERATOR)


@pytest.fixture
def alone(cluster):
    """The operator of the cluster is away, so that whatever happens another has done."""
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 0}})
    yield
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 1}})
    cluster.rolled_out(SYSTEM, OPERATOR)


def test_an_upgrade_to_two_operators_touches_no_pod_and_the_end_leaves_the_job(
    taken_over,  # noqa: ARG001 - is put back
    cluster,
    namespace,
    job,
):
    """A release's whole life, with a job running through it."""
    namespace.apply(job("stays", script=WAIT))
    namespace.wait_for_pod("stays", LONG_S)
    namespace.wait(lambda: namespace.status("stays").get("phase") == "Running")
    before = {kind: fingerprint(namespace, kind) for kind in KINDS}

    helm("test", SYSTEM)
    helm("upgrade", SYSTEM, "--set=operator.replicas=2", "--force-conflicts", "--wait")  # with kubectl
    assert len(operators(namespace)) == 2
    assert {kind: fingerprint(namespace, kind) for kind in KINDS} == before

    helm("uninstall", SYSTEM, "--wait")
    assert cluster.get("deployments", SYSTEM, OPERATOR) is None
    assert {kind: fingerprint(namespace, kind) for kind in KINDS} == before
    assert namespace.status("stays")["phase"] == "Running"


def test_an_operator_of_one_namespace_trains_there(alone, namespace):  # noqa: ARG001 - is put back
    """With Roles only, and everything in that namespace."""
    mode = ("--set=crds.install=false", f"--set=watchNamespaces={{{namespace.name}}}")
    helm("install", namespace.name, *mode, "--wait")

    assert f"{namespace.name}/palaestra-test" in helm("test", namespace.name)
    assert namespace.select("trainingjobs") == []
    helm("uninstall", namespace.name, "--wait")
