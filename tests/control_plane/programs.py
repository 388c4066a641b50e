"""Where etcd, kube-apiserver, kube-controller-manager and kubectl are; built by tests/cluster/programs.sh."""

import os
import subprocess
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "cluster"
PROGRAMS = ("etcd", "kube-apiserver", "kube-controller-manager", "kubectl")
COMMAND = f"tests/cluster/programs.sh {' '.join(PROGRAMS)}"
REQUIRED = "PALAESTRA_REQUIRE_CLUSTER"
BUILD_DEADLINE_S = 1800
MISSING = 3  # what programs.sh --built answers where one of them is missing


class NoPrograms(Exception):
    """The programs are not there; the message names the command that builds them."""


def programs() -> Path:
    """Return the folder that holds the programs; build them where they are required and missing.

    Raises:
        NoPrograms: they are not built, and PALAESTRA_REQUIRE_CLUSTER is not 1; or building them failed.
    """
    wanted = PROGRAMS if os.environ.get(REQUIRED) == "1" else ("--built", *PROGRAMS)
    done = subprocess.run(
        [str(SCRIPTS / "programs.sh"), *wanted],
        capture_output=True,
        text=True,
        timeout=BUILD_DEADLINE_S,
        check=False,
    )
    if done.returncode == MISSING:
        raise NoPrograms(f"no API server is built; build it once (8 minutes) with {COMMAND}")
    if done.returncode:
        raise NoPrograms(f"{COMMAND} failed: {done.stderr[-2000:]}")
    return Path(done.stdout.strip().splitlines()[-1])
