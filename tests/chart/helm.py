"""The chart as Helm renders it; Helm is built by tests/cluster/programs.sh."""

import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml

from tests.control_plane.programs import programs

ROOT = Path(__file__).parents[2]
CHART = ROOT / "charts" / "palaestra"
RELEASE = "palaestra"
NAMESPACE = "palaestra-system"
DEADLINE_S = 60

Object = dict[str, Any]


class HelmRefused(Exception):
    """Helm failed; the text is its error message."""


def helm(*arguments: str, sent: str = "", **environment: str) -> str:
    """Run Helm with `sent` as standard input, and return the output; the timeout is 60 s.

    Raises:
        NoPrograms: Helm is not built.
        HelmRefused: the exit code is not 0.
    """
    program = programs(("helm",)) / "helm"
    done = subprocess.run(
        [str(program), *arguments],
        input=sent,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
        env={"HOME": "/nonexistent", **environment},
    )
    if done.returncode:
        raise HelmRefused(done.stderr)
    return done.stdout


def rendered(values: Object | None = None, *options: str) -> str:
    """Return all objects of the chart with these values, as YAML."""
    where = (RELEASE, str(CHART), f"--namespace={NAMESPACE}")
    chosen = yaml.safe_dump(values or {})
    return helm("template", *where, "--values=-", *options, sent=chosen)


def objects(values: Object | None = None) -> list[Object]:
    """Return all objects of the chart with these values."""
    return [each for each in yaml.safe_load_all(rendered(values)) if each]


def pods(objects: Iterable[Object]) -> dict[str, Object]:
    """Return the spec of every pod, by the name of the object that creates it."""
    return {
        each["metadata"]["name"]: each["spec"]["template"]["spec"]
        if each["kind"] == "Deployment"
        else each["spec"]
        for each in objects
        if each["kind"] in {"Deployment", "Pod"}
    }
