"""Helm's errors in a cluster without a kind that the chart needs; this cluster has only Kubernetes' kinds."""

import pytest

from tests.chart.helm import CHART, NAMESPACE, ROOT, HelmRefused, helm

MONITORS = "monitoring.podMonitor.enabled=true"


def test_monitors_are_refused_until_the_cluster_knows_their_kinds(control_plane):
    """A user finds this error in docs/howto/install.md.

    The remedy there is to install the Prometheus Operator first.
    """
    install = ("install", "palaestra", str(CHART), f"--namespace={NAMESPACE}", "--create-namespace")
    words = 'no matches for kind "PodMonitor"'

    with pytest.raises(HelmRefused, match=words):
        helm(*install, f"--set={MONITORS}", KUBECONFIG=str(control_plane.kubeconfig))

    assert words in (ROOT / "docs/howto/install.md").read_text()
