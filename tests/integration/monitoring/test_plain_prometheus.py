"""The scrape configuration of docs/reference/metrics.md works in a real Prometheus.

Debian's Prometheus has no discovery in Kubernetes, so the tests provide static targets: each port of a pod in
the recorded plan and in the chart. Each target has the labels of the discovery role `pod`.
Source: https://prometheus.io/docs/prometheus/latest/configuration/configuration/#pod.
"""

import re
import subprocess

import pytest
import yaml

from tests.chart.helm import ROOT, objects
from tests.control_plane.programs import programs
from tests.monitoring.prometheus import PROGRAMS, configured
from tests.pages import blocks

FOUND_S = 60
LABELS = ("namespace", "pod", "container", "training_job", "replica", "simulator")
PLAN = ROOT / "tests/golden/minimal.cluster.yaml"


@pytest.fixture
def written():
    """Return the page's scrape configuration, as a user copies it."""
    pages = blocks((ROOT / "docs/reference/metrics.md").read_text(), "yaml")
    [text] = [each for each in pages if "scrape_configs" in each]
    [scrape] = yaml.safe_load(text)["scrape_configs"]
    return scrape


@pytest.fixture
def played(written):
    """Return a function that replaces the discovery in the configuration by static pods."""
    assert written.pop("kubernetes_sd_configs") == [{"role": "pod"}]

    def discovering(*pods):
        targets = [target for pod in pods for target in discovered(**pod)]
        return {**written, "static_configs": targets}

    return discovering


@pytest.fixture
def folder(tmp_path):
    """Return an empty folder for Prometheus."""
    made = tmp_path / "prometheus"
    made.mkdir()
    return made


def training(name="minimal-0-x", phase="Running"):
    """Return a pod of the recorded plan of minimal.yaml."""
    [job] = [each for each in yaml.safe_load_all(PLAN.read_text()) if each["kind"] == "Job"]
    return {"name": name, "phase": phase, "template": job["spec"]["template"]}


def operator():
    """Return a pod of the chart's Deployment."""
    [deployment] = [each for each in objects() if each["kind"] == "Deployment"]
    return {"name": "palaestra-operator-x", "phase": "Running", "template": deployment["spec"]["template"]}


def stranger():
    """Return a pod of another project with a port of the same name."""
    container = {"name": "main", "ports": [{"name": "metrics", "containerPort": 9999}]}
    template = {"metadata": {"labels": {"app": "theirs"}}, "spec": {"containers": [container]}}
    return {"name": "theirs", "phase": "Running", "template": template}


def discovered(name, phase, template):
    """Yield a static target for each port of a pod, with the labels of the discovery."""
    labels = {"namespace": "lab", "pod_name": name, "pod_phase": phase}
    for key, value in template["metadata"]["labels"].items():
        safe = re.sub(r"[^a-zA-Z0-9_]", "_", key)
        labels |= {f"pod_label_{safe}": value, f"pod_labelpresent_{safe}": "true"}
    spec = template["spec"]
    for container in (*spec.get("initContainers", ()), *spec["containers"]):
        for port in container.get("ports", ()):
            of_port = {"pod_container_name": container["name"], "pod_container_port_name": port["name"]}
            metas = {f"__meta_kubernetes_{key}": value for key, value in (labels | of_port).items()}
            yield {"targets": [f"127.0.0.1:{port['containerPort']}"], "labels": metas}


def found(prometheus, count):
    """Return the labels of the targets, or None while there are fewer than `count`.

    No program listens at the targets, so their `up` is 0.
    """
    up = [series["metric"] for series in prometheus.query("up")]
    return {tuple(map(each.get, LABELS)) for each in up} if len(up) >= count else None


def test_promtool_finds_nothing_wrong_with_the_scrape_configuration(played, tmp_path):
    """A user copies the configuration into a file, and Prometheus must accept that file."""
    file = tmp_path / "prometheus.yaml"
    file.write_text(yaml.safe_dump({"scrape_configs": [played()]}))
    command = [programs(PROGRAMS) / "promtool", "check", "config", file]

    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    assert done.returncode == 0, done.stdout + done.stderr


def test_a_plain_prometheus_gives_every_program_the_labels_of_the_dashboards(played, folder):
    """Without the labels `training_job`, `replica` and `simulator`, most panels stay empty."""
    with configured([played(training(), operator(), stranger())], folder) as prometheus:
        targets = prometheus.until(lambda: found(prometheus, 4), FOUND_S)

    of_run = ("lab", "minimal-0-x")
    assert targets == {
        ("lab", "palaestra-operator-x", "operator", None, None, None),
        (*of_run, "trainer", "minimal", "0", None),
        (*of_run, "sim-collect-0", "minimal", "0", "collect-0"),
        (*of_run, "sim-evaluate-0", "minimal", "0", "evaluate-0"),
    }


def test_a_plain_prometheus_asks_no_pod_that_has_ended(played, folder):
    """The pods of finished jobs stay for weeks, and each port would be a target that is down."""
    pods = (training("done", "Succeeded"), training("broken", "Failed"), training("goes-on"))
    with configured([played(*pods)], folder) as prometheus:
        targets = prometheus.until(lambda: found(prometheus, 3), FOUND_S)

    assert {pod for _, pod, *_ in targets} == {"goes-on"}
