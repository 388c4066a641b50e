"""manifests/install.yaml: the chart with its default values, for users without Helm."""

from typing import Any

import yaml

from tests.chart.helm import NAMESPACE, ROOT, rendered

PATH = ROOT / "manifests" / "install.yaml"
SECRETS_ROLE = "palaestra-job-secrets"
HEAD = f"""\
# Rendered from charts/palaestra by `make golden`; edit that instead.
# Helm makes no namespace that can be labelled, so this one stands here.
apiVersion: v1
kind: Namespace
metadata:
  name: {NAMESPACE}
  labels:
    app.kubernetes.io/name: palaestra
    pod-security.kubernetes.io/enforce: restricted
"""


def text() -> str:
    """Return the whole installation as YAML.

    Raises:
        NoPrograms: Helm is not built.
    """
    without = {"crds": {"keep": False}, "test": {"enabled": False}}  # both need Helm
    return HEAD + rendered(without)


def installed() -> list[dict[str, Any]]:
    """Return the objects of the recorded installation."""
    return [each for each in yaml.safe_load_all(PATH.read_text()) if each]
