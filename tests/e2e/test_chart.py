"""A release of the chart for one namespace, while the cluster's operator is scaled to 0.

tests/e2e/test_pages.py runs docs/howto/install.md, which installs the release for a whole cluster.
"""

import os
import subprocess

import pytest

from tests.chart.helm import CHART
from tests.e2e.namespace import OPERATOR, SYSTEM
from tests.e2e.tour import tour

pytestmark = [pytest.mark.changes_the_operator, pytest.mark.timeout(1200)]

WITHIN_S = 600  # the timeout of `helm test`; the images are on the node already
RELEASE = "palaestra"


def helm(verb, namespace, *options):
    """Run Helm for the release on the cluster of $KUBECONFIG, and return its output."""
    chart = [str(CHART)] if verb == "install" else []
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
def alone(cluster):
    """Scale the cluster's operator to 0, so that only the operator of the test's release acts."""
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 0}})
    yield
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 1}})
    cluster.rolled_out(SYSTEM, OPERATOR)


def test_an_operator_of_one_namespace_trains_there(alone, namespace):  # noqa: ARG001 - it must scale
    """The release may create no ClusterRole, because a team may install it in its own namespace."""
    mode = ("--set=crds.install=false", f"--set=watchNamespaces={{{namespace.name}}}")
    helm("install", namespace.name, *mode, "--wait")

    assert f"{namespace.name}/palaestra-test" in helm("test", namespace.name)
    assert namespace.select("trainingjobs") == []
    tour(namespace, namespace.name)  # test_permissions.py checks the rights that were used
    helm("uninstall", namespace.name, "--wait")
