"""CustomResourceDefinitions of other projects that the chart uses, from the Go modules of these projects."""

import json
import os
import subprocess
from pathlib import Path

from tests.cluster.images import version_of
from tests.control_plane.programs import REQUIRED, NoPrograms

PROMETHEUS = ("github.com/prometheus-operator/prometheus-operator@v0.85.0", "example/prometheus-operator-crd")
KUEUE = (f"sigs.k8s.io/kueue@{version_of('kueue', 'sigs.k8s.io/kueue')}", "config/components/crd/bases")
DOWNLOAD_S = 300


def definitions(module: str, folder: str) -> Path:
    """Return a folder of a Go module, such as the folder of its CustomResourceDefinitions.

    The module is downloaded only if the variable PALAESTRA_REQUIRE_CLUSTER is 1.

    Raises:
        NoPrograms: Go or the module is missing.
    """
    proxy = {} if os.environ.get(REQUIRED) == "1" else {"GOPROXY": "off"}
    try:
        done = subprocess.run(
            ["go", "mod", "download", "-json", module],
            env={**os.environ, **proxy},
            capture_output=True,
            text=True,
            timeout=DOWNLOAD_S,
            check=False,
        )
    except FileNotFoundError as error:
        raise NoPrograms("Go is missing; install Go 1.26") from error
    answer = json.loads(done.stdout or "{}")
    if "Dir" not in answer:
        raise NoPrograms(f"{module} is not downloaded; get it with: go mod download {module}")
    return Path(answer["Dir"]) / folder


def kinds_of_prometheus() -> list[str]:
    """Return kubectl's options for those definitions of the Prometheus Operator that the chart uses.

    Raises:
        NoPrograms: Go or the module is missing.
    """
    folder, kinds = definitions(*PROMETHEUS), ("podmonitors", "servicemonitors", "prometheusrules")
    return [f"--filename={folder}/monitoring.coreos.com_{each}.yaml" for each in kinds]
