"""Every value has a description and a rule; Helm refuses a wrong value and names its path."""

import json
from typing import Any

import pytest
import yaml

from tests.chart import readme
from tests.chart.helm import CHART, HelmRefused, helm, objects
from tests.chart.modes import MODES

SCHEMA = json.loads((CHART / "values.schema.json").read_text())
VALUES = list(readme.values(readme.VALUES.read_text()))
WRONG = [  # the value that is set, its content, and the path of the mistake below it
    ("operator.replicas", 0, ""),
    ("operator.replicas", 1.5, ""),
    ("operator.replicas", "2", ""),
    ("operator.workers", 0, ""),
    ("operator.workers", True, ""),
    ("operator.resyncSeconds", "10m", ""),
    ("operator.resources", {"limits": {"memory": "much"}}, "/limits/memory"),
    ("operator.tolerations", {"key": "dedicated"}, ""),
    ("watchNamespaces", "robots", ""),
    ("watchNamespaces", ["robots", "robots"], ""),
    ("watchNamespaces", ["Robots"], "/0"),
    ("watchNamespaces", ["a,b"], "/0"),
    ("images.pullPolicy", "Sometimes", ""),
    ("images.registry", "https://registry.example.com", ""),
    ("images.operator.tag", "latest", ""),
    ("images.operator.tag", "a b", ""),
    ("images.trainer.digest", "sha256:abc", ""),
    ("imagePullSecrets", ["registry"], "/0"),
    ("imagePullSecrets", [{"secret": "registry"}], "/0"),
    ("podSecurity.fixedUser", 65532, ""),
    ("crds.install", "yes", ""),
    ("jobs.allowedPodLabels", "example.com/", ""),
    ("jobs.allowedPodLabels", ["/team"], "/0"),
    ("jobs.allowedPodAnnotations", ["*"], "/0"),
    ("jobs.allowedPodAnnotations", ["/"], "/0"),
    ("jobs.allowedPriorityClasses", ["*"], "/0"),
    ("jobs.allowedRuntimeClasses", "nvidia", ""),
    ("jobs.allowedTolerations", [{"key": "dedicated"}], "/0"),
    ("jobs.allowedAffinityNamespaces", ["Storage"], "/0"),
    ("jobs.allowedAntiAffinityLabels", ["a b"], "/0"),
    ("jobs.nodeSelector", {"kubernetes.io/arch": 64}, "/kubernetes.io~1arch"),
    ("jobs.resources.rosMaster", {"cpu": "1"}, ""),
    ("networkPolicy.egress.apiServerPorts", [], ""),
    ("networkPolicy.egress.apiServerPorts", [70000], "/0"),
    ("monitoring.podMonitor.interval", 15, ""),
    ("monitoring.podMonitor.interval", "often", ""),
    ("monitoring.podMonitor.sampleLimit", -1, ""),
    ("monitoring.podMonitor.labelLimit", "32", ""),
    ("monitoring.podMonitor.bodySizeLimit", "1M", ""),
    ("monitoring.podMonitor.bodySizeLimit", 1000, ""),
    ("monitoring.namespace", "", ""),
    ("monitoring.prometheusRule.runbooks", "git.example.com", ""),
    ("monitoring.prometheusRule.runbooks", "https://git.example.com/", ""),
    ("monitoring.dashboards.labels", {"grafana_dashboard": 1}, "/grafana_dashboard"),
    ("test.deadlineSeconds", -1, ""),
    ("tensorboard.folder", "../secrets", ""),
    ("tensorboard.folder", "/runs", ""),
    ("tensorboard.folder", "runs --bind_all", ""),
    ("serviceAccount.name", "", ""),
]


def chosen(path: str, value: Any) -> dict[str, Any]:
    """Return a values file's content that sets only one value."""
    for step in reversed(path.split(".")):
        value = {step: value}
    return value


def refusal(values: dict[str, Any]) -> str:
    """Return the error message with which Helm refuses these values."""
    with pytest.raises(HelmRefused) as refused:
        objects(values)
    return str(refused.value)


@pytest.mark.parametrize(("path", "value", "below"), WRONG, ids=str)
def test_a_wrong_value_is_refused_with_its_place(path, value, below):
    """Helm refuses the value before it sends anything to the cluster."""
    assert f"at '/{path.replace('.', '/')}{below}'" in refusal(chosen(path, value))


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"replicas": 2}, "additional properties 'replicas' not allowed"),
        ({"operator": {"replica": 2}}, "at '/operator': additional properties 'replica' not allowed"),
        (
            {"operator": {"podLabels": {"app.kubernetes.io/name": "other"}}},
            "invalid propertyName 'app.kubernetes.io/name'",
        ),
        ({"operator": {"replicas": 2, "leaderElection": False}}, "at '/operator/leaderElection'"),
        ({"tensorboard": {"enabled": True}}, "at '/tensorboard/existingClaim'"),
        ({"jupyter": {"enabled": True}}, "at '/jupyter/tokenSecret/name'"),
    ],
)
def test_values_that_do_not_go_together_are_refused(values, told):
    """Without an error, a misspelled value, or a value that needs another value, would have no effect."""
    assert told in refusal(values)


def properties(schema: dict[str, Any], path: tuple[str, ...] = ()) -> set[str]:
    """Return the paths of all values that the schema knows."""
    whole = schema.get("$ref") == "#/definitions/resources"
    inner = {**schema, **_definition(schema)}.get("properties")
    if not inner or whole:
        return {".".join(path)}
    return {each for name, below in inner.items() for each in properties(below, (*path, name))}


def _definition(schema: dict[str, Any]) -> dict[str, Any]:
    name = schema.get("$ref", "").removeprefix("#/definitions/")
    return SCHEMA["definitions"][name] if name else {}


def test_the_schema_knows_every_value_and_no_other():
    """A value that only values.yaml or only the schema has is a mistake of the chart's author."""
    assert properties(SCHEMA) == {value.path for value in VALUES} | {"enabled", "global"}


@pytest.mark.parametrize("value", VALUES, ids=lambda value: value.path)
def test_every_value_has_a_sentence(value):
    """A user of the chart must not have to read the templates."""
    assert value.sentence.endswith(".")


@pytest.mark.parametrize("mode", MODES)
def test_helm_finds_nothing_wrong(mode):
    """Helm's own linter finds mistakes that an installation accepts; `--strict` makes warnings errors."""
    values = yaml.safe_dump(MODES[mode])

    assert "0 chart(s) failed" in helm("lint", str(CHART), "--strict", "--values=-", sent=values)


PARENT = """\
apiVersion: v2
name: platform
version: 1.0.0
dependencies:
  - {name: palaestra, version: ">=0", condition: palaestra.enabled}
"""


@pytest.mark.parametrize("enabled", [True, False])
def test_a_parent_chart_switches_the_chart_on_and_off(tmp_path, enabled):
    """Helm's `condition` sets the value `enabled` of this chart, and the schema once refused this value."""
    (tmp_path / "charts").mkdir()
    (tmp_path / "charts" / "palaestra").symlink_to(CHART)
    (tmp_path / "Chart.yaml").write_text(PARENT)
    (tmp_path / "values.yaml").write_text(yaml.safe_dump({"palaestra": {"enabled": enabled}}))

    shown = helm("template", "platform", str(tmp_path))

    assert bool(shown.strip()) is enabled
