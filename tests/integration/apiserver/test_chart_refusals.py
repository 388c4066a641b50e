"""The errors of Helm in a cluster that lacks a kind; this cluster knows only Kubernetes' own kinds."""

import pytest

from tests.chart.helm import CHART, NAMESPACE, ROOT, HelmRefused, helm

MONITORS = "monitoring.podMonitor.enabled=true"


def test_monitors_are_refused_until_the_cluster_knows_their_kinds(control_plane):
    """docs/howto/install.md quotes this error with its remedy: install the Prometheus Operator first."""
    install = ("install", "palaestra", str(CHART), f"--namespace={NAMESPACE}", "--create-namespace")
    words = 'no matches for kind "PodMonitor"'

    with pytest.raises(HelmRefused, match=words):
        helm(*install, f"--set={MONITORS}", KUBECONFIG=str(control_plane.kubeconfig))

    assert words in (ROOT / "docs/howto/install.md").read_text()
