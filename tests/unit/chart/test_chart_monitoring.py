"""The chart's objects for monitoring: TensorBoard, notebooks, alerts, dashboards and scrape targets."""

import json
import re

import pytest
import yaml

from palaestra_trainer.run.tensorboard_link import FOLDER
from tests.chart.helm import CHART, objects, pods
from tests.chart.modes import MODES, merged


def test_what_has_no_login_is_reached_by_nobody(one):
    """These servers have no login.

    `kubectl port-forward` still works: it connects from the node, which a NetworkPolicy does not block.
    """
    for name in ("palaestra-tensorboard", "palaestra-jupyter"):
        policy = one("offline", "NetworkPolicy", name)["spec"]
        assert "Ingress" in policy["policyTypes"]
        assert "ingress" not in policy


def test_tensorboard_changes_no_run(one):
    """An error in TensorBoard must not destroy a run, so TensorBoard mounts the volumes read-only."""
    pod = one("offline", "Deployment", "palaestra-tensorboard")["spec"]["template"]["spec"]
    mounts = {mount["name"]: mount for mount in pod["containers"][0]["volumeMounts"]}

    assert mounts["runs"]["readOnly"] is True
    assert pod["volumes"][0]["persistentVolumeClaim"] == {"claimName": "runs", "readOnly": True}


@pytest.mark.parametrize(("chosen", "shown"), [({}, f"/runs/{FOLDER}"), ({"folder": ""}, "/runs")])
def test_tensorboard_shows_the_links_that_trainers_make(chosen, shown):
    """TensorBoard follows symbolic links, so in the root of the claim it would show each run twice.

    One of the two runs would have a UID as its name.
    """
    made = objects(merged(MODES["offline"], {"tensorboard": chosen}))

    [server] = pods(made)["palaestra-tensorboard"]["containers"]
    assert server["command"][1] == f"--logdir={shown}"


def test_the_token_of_the_notebooks_is_in_no_object(one):
    """A token in an object could be read by everybody who may read the object.

    It stays in its Secret, and the server receives only the path of the mounted file.
    """
    pod = one("offline", "Deployment", "palaestra-jupyter")["spec"]["template"]["spec"]
    [server] = pod["containers"]

    environment = {each["name"]: each["value"] for each in server["env"]}
    [folder] = [mount["mountPath"] for mount in server["volumeMounts"] if mount["name"] == "token"]
    [volume] = [each["secret"] for each in pod["volumes"] if each["name"] == "token"]
    assert volume["secretName"] == "notebooks"
    assert [f"{folder}/{item['path']}" for item in volume["items"]] == [environment["JUPYTER_TOKEN_FILE"]]
    assert environment.keys() == {"JUPYTER_TOKEN_FILE"}


def test_the_alerts_are_those_of_the_file(one):
    """`promtool` checks alerts.yaml, so the installed rules must be equal to it."""
    rules_of_file = yaml.safe_load((CHART / "alerts.yaml").read_text())

    assert one("monitored", "PrometheusRule", "palaestra")["spec"] == rules_of_file


def test_runbooks_are_links_if_a_value_has_the_address():
    """The chart cannot know the address, because it depends on where the project's files are hosted."""
    address = "https://git.example.com/palaestra/blob/main"
    rule = {"enabled": True, "runbooks": address}

    made = objects({"monitoring": {"prometheusRule": rule}})

    (groups,) = (each["spec"]["groups"] for each in made if each["kind"] == "PrometheusRule")
    links = [each["annotations"]["runbook_url"] for group in groups for each in group["rules"]]
    assert all(link.startswith(f"{address}/docs/howto/alerts.md#") for link in links)
    assert links


def test_every_dashboard_is_mounted_as_it_is(made):
    """Grafana's sidecar finds a dashboard only by the label `grafana_dashboard`.

    Other tests check the file, so the mounted content must be equal to it.
    """
    found = {
        name: (json.loads(text), each["metadata"]["labels"].get("grafana_dashboard"))
        for each in made("monitored")
        if each["kind"] == "ConfigMap" and each["metadata"]["name"] != "palaestra-trial"
        for name, text in each["data"].items()
    }

    assert found == {
        path.name: (json.loads(path.read_text()), "1") for path in (CHART / "dashboards").glob("*.json")
    }


def test_training_pods_are_scraped_on_every_port_that_has_metrics(one):
    """The plan names the ports of a pod, so the regular expression must match these names."""
    [endpoint] = one("monitored", "PodMonitor", "palaestra-training")["spec"]["podMetricsEndpoints"]
    [keep] = [each for each in endpoint["relabelings"] if each.get("action") == "keep"]

    assert re.fullmatch(keep["regex"], "metrics")
    assert re.fullmatch(keep["regex"], "sim-31")
    assert not re.fullmatch(keep["regex"], "ros")


def test_what_prometheus_takes_from_a_training_pod_is_bounded(one):
    """The job author's program serves these metrics and could give Prometheus a million series."""
    bounded = one("monitored", "PodMonitor", "palaestra-training")["spec"]
    [none] = [
        each
        for each in objects(
            {
                "monitoring": {
                    "podMonitor": {"enabled": True, "sampleLimit": 0, "labelLimit": 0, "bodySizeLimit": 0}
                }
            }
        )
        if each["kind"] == "PodMonitor"
    ]

    limits = {name: bounded.get(name) for name in ("sampleLimit", "labelLimit", "bodySizeLimit")}
    assert limits == {"sampleLimit": 2000, "labelLimit": 32, "bodySizeLimit": "1MB"}
    assert not limits.keys() & none["spec"].keys()


def test_notebooks_may_start_simulators_only_if_the_release_says_so():
    """A program with the token can create pods, so by default the server gets no token."""
    mode = {"jupyter": {"enabled": True, "tokenSecret": {"name": "notebooks"}}}
    without, with_token = (objects(merged(mode, {"jupyter": {"simulators": on}})) for on in (False, True))

    def of(made, kind):
        return [
            each for each in made if each["kind"] == kind and each["metadata"]["name"] == "palaestra-jupyter"
        ]

    pod = of(without, "Deployment")[0]["spec"]["template"]["spec"]
    assert pod["automountServiceAccountToken"] is False
    assert of(without, "Role") == of(without, "ServiceAccount") == []
    pod = of(with_token, "Deployment")[0]["spec"]["template"]["spec"]
    assert (pod["automountServiceAccountToken"], pod["serviceAccountName"]) == (True, "palaestra-jupyter")
    (role,), (binding,) = of(with_token, "Role"), of(with_token, "RoleBinding")
    assert all("*" not in rule["verbs"] + rule["resources"] for rule in role["rules"])
    assert binding["subjects"][0]["namespace"] == role["metadata"]["namespace"]
