"""The folder of etcd, kube-apiserver, kubectl, helm and others, which tests/cluster/programs.sh builds."""

import os
import subprocess
from functools import cache
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "cluster"
PROGRAMS = ("etcd", "kube-apiserver", "kube-controller-manager", "kubectl")
REQUIRED = "PALAESTRA_REQUIRE_CLUSTER"
BUILD_DEADLINE_S = 1800
MISSING = 3  # the exit code of `programs.sh --built` if a program is missing


class NoPrograms(Exception):
    """Programs of a cluster are missing; the message contains the command that builds them."""


@cache
def programs(names: tuple[str, ...] = PROGRAMS) -> Path:
    """Return the folder with the programs; build missing programs if PALAESTRA_REQUIRE_CLUSTER is 1.

    Raises:
        NoPrograms: a program is missing and may not be built, or the build failed.
    """
    command = f"tests/cluster/programs.sh {' '.join(names)}"
    wanted = names if os.environ.get(REQUIRED) == "1" else ("--built", *names)
    done = subprocess.run(
        [str(SCRIPTS / "programs.sh"), *wanted],
        capture_output=True,
        text=True,
        timeout=BUILD_DEADLINE_S,
        check=False,
    )
    if done.returncode == MISSING:
        raise NoPrograms(f"programs of a cluster are not built; build them once (minutes) with {command}")
    if done.returncode:
        raise NoPrograms(f"{command} failed: {done.stderr[-2000:]}")
    return Path(done.stdout.strip().splitlines()[-1])
