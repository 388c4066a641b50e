"""Sets of values that contain every pair of values, so that no template relies on a default."""

from collections.abc import Iterable
from itertools import combinations
from math import comb
from typing import Any

from tests.chart.modes import DIGEST, MODES, PARTS, Values, merged

MONITORS = ("podMonitor", "serviceMonitor", "prometheusRule", "dashboards")
RESOURCES = {"requests": {"cpu": "1"}, "limits": {"memory": "1Gi"}}
SPREAD = {"maxSkew": 1, "topologyKey": "zone", "whenUnsatisfiable": "DoNotSchedule"}
LABELS = {"example.com/team": "robots"}

# For each value of the chart, a value other than its default.
OTHERS: dict[str, Any] = {
    "images.registry": "registry.example.com:5000/robots",
    "images.pullPolicy": "Never",
    **{f"images.{part}.repository": "other" for part in PARTS},
    **{f"images.{part}.tag": "1.2" for part in PARTS},
    **{f"images.{part}.digest": DIGEST for part in PARTS},
    "imagePullSecrets": [{"name": "registry"}],
    "crds.install": False,
    "crds.keep": False,
    "watchNamespaces": ["robots", "drones"],
    "operator.replicas": 3,
    "operator.leaderElection": False,
    "operator.workers": 2,
    "operator.resyncSeconds": 60,
    "operator.resources": RESOURCES,
    "operator.topologySpreadConstraints": [SPREAD],
    **{f"operator.{name}": chosen for name, chosen in MODES["closed"]["operator"].items()},
    "serviceAccount.create": False,
    "serviceAccount.name": "other",
    "serviceAccount.annotations": LABELS,
    "podDisruptionBudget.enabled": False,
    "networkPolicy.enabled": False,
    "networkPolicy.egress.restricted": True,
    "networkPolicy.egress.apiServerPorts": [8443],
    "monitoring.namespace": "elsewhere",
    **{f"monitoring.{each}.enabled": True for each in MONITORS},
    **{f"monitoring.{each}.labels": LABELS for each in MONITORS},
    "monitoring.podMonitor.interval": "1m",
    "monitoring.podMonitor.sampleLimit": 0,
    "monitoring.podMonitor.labelLimit": 0,
    "monitoring.podMonitor.bodySizeLimit": 0,
    "monitoring.serviceMonitor.interval": "1m",
    "monitoring.prometheusRule.runbooks": "https://git.example.com/palaestra/blob/main",
    "monitoring.dashboards.annotations": LABELS,
    "monitoring.dashboards.namespace": "elsewhere",
    "jobs.allowedPodLabels": ["example.com/team"],
    "jobs.allowedPodAnnotations": ["example.com/"],
    "jobs.allowedPriorityClasses": ["urgent"],
    "jobs.allowedRuntimeClasses": ["nvidia"],
    "jobs.allowedTolerations": ["example.com/spot"],
    "jobs.allowedAffinityNamespaces": ["storage"],
    "jobs.allowedAntiAffinityLabels": ["palaestra.dev/job"],
    "jobs.nodeSelector": LABELS,
    "jobs.hostUsers": False,
    "podSecurity.fixedUser": False,
    **{f"jobs.resources.{each}": RESOURCES for each in ("rosMaster", "simulator", "trainer")},
    "test.enabled": False,
    "test.namespace": "elsewhere",
    "test.deadlineSeconds": 60,
    "test.resources": RESOURCES,
    "tensorboard.enabled": True,
    "tensorboard.existingClaim": "runs",
    "tensorboard.namespace": "elsewhere",
    "tensorboard.folder": "",
    "tensorboard.resources": RESOURCES,
    "jupyter.enabled": True,
    "jupyter.namespace": "elsewhere",
    "jupyter.tokenSecret.name": "notebooks",
    "jupyter.tokenSecret.key": "secret",
    "jupyter.existingClaim": "notes",
    "jupyter.simulators": True,
    "jupyter.resources": RESOURCES,
}
# For some values of the chart, the other values that the schema then requires.
BESIDE: dict[str, dict[str, Any]] = {
    "operator.leaderElection": {"operator.replicas": 1},
    "tensorboard.enabled": {"tensorboard.existingClaim": "runs"},
    "jupyter.enabled": {"jupyter.tokenSecret.name": "notebooks"},
}


def rows() -> list[tuple[str, ...]]:
    """Return sets of paths. For any two paths, there are sets with both, with neither, and with only one.

    The first of the n + 1 sets is empty. Each path is in n/2 of the other sets, rounded up. For two paths,
    the groups of sets that contain them overlap, and neither group contains the other (Katona 1973).
    """
    n = next(odd for odd in range(1, 99, 2) if comb(odd, odd // 2 + 1) >= len(OTHERS))
    halves = list(zip(OTHERS, combinations(range(1, n + 1), n // 2 + 1), strict=False))
    return [tuple(path for path, half in halves if row in half) for row in range(n + 1)]


def together(row: Iterable[str]) -> Values:
    """Return values other than the defaults for these paths, and the values that they require."""
    chosen = {path: OTHERS[path] for path in row}
    for path in tuple(chosen):
        chosen |= BESIDE.get(path, {})
    return merged(*(_below(path, value) for path, value in chosen.items()))


def _below(path: str, value: Any) -> Values:
    for step in reversed(path.split(".")):
        value = {step: value}
    whole: Values = value
    return whole
