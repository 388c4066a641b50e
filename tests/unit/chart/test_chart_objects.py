"""The objects that the chart installs in every mode."""

import argparse
import json
import re
import subprocess
from importlib.metadata import version

import pytest
import yaml

import palaestra.api
from palaestra.api.crd import crd
from palaestra.cli import operator
from palaestra.cli.operator import ALLOWANCES
from palaestra.operator.options import NAME
from palaestra.plan import Images
from tests.chart.helm import CHART, NAMESPACE, HelmRefused, helm, objects, pods
from tests.chart.installation import SECRETS_ROLE
from tests.chart.modes import DIGEST, MODES, merged
from tests.chart.rights import held

CLUSTER_WIDE = {"ClusterRole", "ClusterRoleBinding", "CustomResourceDefinition"}
REGISTRY = "registry.example.com:5000/robots/"
every_mode = pytest.mark.parametrize("mode", MODES)


def options(deployment):
    """Return the operator's options as its command line parses them."""
    [container] = deployment["spec"]["template"]["spec"]["containers"]
    parser = argparse.ArgumentParser()
    operator.add(parser.add_subparsers())
    return parser.parse_args(container["command"][1:])


def rules(roles):
    """Return all rules of some roles."""
    return {right for role in roles for right in held(role)}


def roles(objects):
    """Return the Roles and ClusterRoles by name and namespace."""
    found = [each for each in objects if each["kind"] in {"Role", "ClusterRole"}]
    return {(each["metadata"]["name"], each["metadata"].get("namespace")): each for each in found}


def bound(objects):
    """Return the roles that a binding refers to."""
    bindings = [each for each in objects if each["kind"].endswith("Binding")]
    names = {(each["roleRef"]["name"], each["metadata"].get("namespace")) for each in bindings}
    return [role for key, role in roles(objects).items() if key in names]


@every_mode
def test_every_object_has_a_place_and_a_name_of_its_own(made, mode):
    """Of two objects with one name, `kubectl apply` would overwrite the first with the second."""
    keys = [
        (each["kind"], each["metadata"].get("namespace"), each["metadata"]["name"]) for each in made(mode)
    ]

    assert len(keys) == len(set(keys))
    assert [key for key in keys if (key[1] is None) != (key[0] in CLUSTER_WIDE)] == []
    assert [key for key in keys if len(key[2]) > 63] == []


@every_mode
def test_every_pod_meets_the_restricted_standard(made, mode):
    """A namespace that enforces the standard accepts every pod of the chart."""
    for pod in pods(made(mode)).values():
        assert pod["securityContext"]["runAsNonRoot"] is True
        assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
        for container in pod["containers"]:
            security = container["securityContext"]
            assert security["readOnlyRootFilesystem"] is True
            assert security["allowPrivilegeEscalation"] is False
            assert security["capabilities"] == {"drop": ["ALL"]}
            assert {"requests", "limits"} <= container["resources"].keys()


@every_mode
def test_only_the_operator_and_the_trial_hold_a_token(made, mode):
    """The other pods send no requests to the API server, so a token there could only be stolen."""
    trusted = {
        name for name, pod in pods(made(mode)).items() if pod.get("automountServiceAccountToken", True)
    }

    assert trusted == {NAME, "palaestra-test"}


@every_mode
def test_the_trial_is_one_hook(made, mode):
    """Helm reports each hook as a separate test suite.

    With five hooks one training appeared as five suites.
    """
    hooks = [each for each in made(mode) if "helm.sh/hook" in each["metadata"].get("annotations", {})]

    assert [(each["kind"], each["metadata"]["name"]) for each in hooks] == [("Pod", "palaestra-test")]


def test_the_account_of_the_trial_can_be_left_out(made):
    """The ServiceAccount of `helm test` exists as long as the release, not only during the test.

    Some platforms forbid an account that may always create TrainingJobs.
    """
    everything, without = made("default"), objects({"test": {"enabled": False}})

    left_out = [each for each in everything if each not in without]
    assert {each["metadata"]["labels"]["app.kubernetes.io/component"] for each in left_out} == {"test"}
    assert sorted(each["kind"] for each in left_out) == [
        *("ConfigMap", "Pod", "Role", "RoleBinding", "ServiceAccount")
    ]
    assert "palaestra-trial" not in str(without)


@every_mode
def test_no_right_is_a_wildcard_and_none_that_is_bound_reads_secrets(made, mode):
    """The roles list each verb of the operator.

    Only an administrator may bind the role that reads Secrets.
    """
    assert not [right for right in rules(roles(made(mode)).values()) if "*" in "".join(right)]
    assert bound(made(mode))
    assert not [right for right in rules(bound(made(mode))) if "secrets" in right]


def test_a_list_of_namespaces_needs_no_right_in_the_cluster(made):
    """A user without permission to create ClusterRoles can install all but the CustomResourceDefinition."""
    assert not [each for each in made("namespaced") if each["kind"] in CLUSTER_WIDE]
    assert {key for key in roles(made("namespaced")) if key[1] != NAMESPACE} == {
        (name, namespace)
        for name in ("palaestra-jobs", SECRETS_ROLE, "palaestra-trial")
        for namespace in ("robots", "drones")
    } - {("palaestra-trial", "drones")}


def test_no_pod_names_a_user_where_the_cluster_chooses_it():
    """OpenShift refuses a pod whose user ID is outside the range of the namespace."""
    all_pods = merged(MODES["everything"], {"podSecurity": {"fixedUser": False}})
    text = json.dumps(objects(all_pods))

    assert not re.search(r"runAs(User|Group)\b|fsGroup\b", text)
    assert "--no-fixed-user" in text


def test_both_modes_hold_the_same_rights(made):
    """The operator sends the same requests in both modes."""
    assert rules(bound(made("namespaced"))) == rules(bound(made("default")))


@every_mode
def test_the_operator_understands_its_options(one, mode):
    """The operator must be able to parse every option that the chart passes to it."""
    chosen = options(one(mode, "Deployment"))

    assert chosen.monitoring_namespace == "monitoring"
    assert chosen.namespaces == MODES[mode].get("watchNamespaces", [])
    assert chosen.leader_elect is True


def test_what_pods_may_carry_and_where_they_run_reaches_the_operator(one):
    """The chart passes these values as options of the operator's command line.

    By default jobs may set none of the restricted fields, and no node selector is required.
    """
    closed, default = options(one("closed", "Deployment")), options(one("default", "Deployment"))

    allowances = [field for _, field, *_ in ALLOWANCES]
    assert {field: getattr(closed, field) for field in allowances} == {
        "pod_labels": ["example.com/"],
        "pod_annotations": ["example.com/", "note"],
        "priority_classes": ["urgent"],
        "runtime_classes": ["nvidia"],
        "tolerations": ["dedicated", "example.com/"],
        "affinity_namespaces": ["storage"],
        "anti_affinity_labels": ["palaestra.dev/job"],
    }
    assert {field: getattr(default, field) for field in allowances} == {field: [] for field in allowances}
    assert dict(closed.node_selector) == {"kubernetes.io/os": "linux"}
    assert default.node_selector == []
    assert (closed.host_users, default.host_users) == (False, True)


def test_a_pod_has_a_user_namespace_only_where_it_is_asked_for(one):
    """A node without user namespaces would never start such a pod."""
    closed, default = (one(mode, "Deployment")["spec"]["template"]["spec"] for mode in ("closed", "default"))

    assert closed["hostUsers"] is False
    assert "hostUsers" not in default


def test_the_operator_s_defaults_are_those_of_its_release(one):
    """By default the chart leaves these options out, so the defaults of `palaestra operator --help` apply."""
    chosen, release = options(one("default", "Deployment")), Images.of_release(version("palaestra"))

    assert (chosen.trainer_image, chosen.stub_image, chosen.mujoco_image, chosen.webots_image) == (
        release.trainer,
        release.stub,
        release.mujoco,
        None,
    )
    assert (chosen.workers, chosen.resync) == (4, 600)


@pytest.mark.parametrize(
    ("image", "chosen"),
    [
        ({"tag": "1.2", "digest": DIGEST}, None),
        ({"repository": "palaestra-webots", "tag": "1.2"}, "palaestra-webots:1.2"),
        ({"repository": "palaestra-webots", "digest": DIGEST}, f"palaestra-webots@{DIGEST}"),
        ({"repository": "palaestra-webots"}, f"palaestra-webots:{version('palaestra')}"),
    ],
    ids=str,
)
def test_the_image_of_webots_has_no_default(made, image, chosen):  # noqa: ARG001 - skips without Helm
    """Palaestra publishes no such image, so the operator must not plan pods that never start."""
    [deployment] = [each for each in objects({"images": {"webots": image}}) if each["kind"] == "Deployment"]

    assert options(deployment).webots_image == chosen


def test_every_image_comes_from_the_registry_by_its_digest(made, one):
    """An offline cluster can pull only from this registry.

    So the chart must take every image from it, also those of `helm test` and of the optional servers.
    """
    images = {container["image"] for pod in pods(made("offline")).values() for container in pod["containers"]}
    chosen = options(one("offline", "Deployment"))
    images |= {chosen.trainer_image, chosen.stub_image, chosen.mujoco_image, chosen.webots_image}

    assert {image for image in images if not (image.startswith(REGISTRY) and image.endswith(DIGEST))} == set()
    assert len(images) == 6


def test_everything_that_pulls_has_the_secret_of_the_registry(made, one):
    """The job of `helm test`, whose pods the operator plans, needs the Secret too."""
    job = yaml.safe_load(one("offline", "ConfigMap", "palaestra-trial")["data"]["job.yaml"])

    assert {len(pod["imagePullSecrets"]) for pod in pods(made("offline")).values()} == {1}
    assert job["spec"]["imagePullSecrets"] == [{"name": "registry"}]


def test_an_image_is_never_the_latest(made):
    """A release is upgraded only when a person decides it."""
    tags = {
        container["image"].partition(":")[2]
        for pod in pods(made("default")).values()
        for container in pod["containers"]
    }

    assert tags == {version("palaestra")}


@every_mode
def test_the_trial_is_a_job_that_the_api_takes(one, mode):
    """With an invalid job `helm test` would fail in the user's cluster."""
    namespace = MODES[mode].get("watchNamespaces", [NAMESPACE])[0]

    text = one(mode, "ConfigMap", "palaestra-trial")["data"]["job.yaml"]

    job = palaestra.api.load(text, "job.yaml")
    assert job.metadata.namespace == namespace
    assert job.spec.ttl_seconds_after_finished is not None
    assert job.spec.active_deadline_seconds == 900


def test_the_definition_is_that_of_the_models_and_is_kept(one):
    """The definition is a template, so that Helm upgrades it.

    The annotation keeps the definition, and with it all jobs, after `helm uninstall`.
    """
    definition = one("default", "CustomResourceDefinition", "trainingjobs.palaestra.dev")

    annotations = definition["metadata"].pop("annotations")
    assert annotations == {"helm.sh/resource-policy": "keep"}
    assert definition == crd()


def test_more_than_one_operator_is_spread_and_survives_a_drain(made, one):
    """With a single operator, a disruption budget would block every drain."""
    spec = one("available", "Deployment")["spec"]

    [spread] = spec["template"]["spec"]["topologySpreadConstraints"]
    assert spread["labelSelector"] == spec["selector"]
    assert spread["topologyKey"] == "kubernetes.io/hostname"
    assert one("available", "PodDisruptionBudget")["spec"] == {
        "minAvailable": 1,
        "selector": spec["selector"],
    }
    assert "PodDisruptionBudget" not in {each["kind"] for each in made("default")}


@every_mode
def test_selectors_find_the_pods_that_they_are_for(made, mode):
    """Kubernetes reports no error for a Service or a policy whose selector matches no pod."""
    labels = {
        each["metadata"]["name"]: each["spec"]["template"]["metadata"]["labels"]
        for each in made(mode)
        if each["kind"] == "Deployment"
    }

    for each in made(mode):
        if each["kind"] in {"Service", "NetworkPolicy", "PodDisruptionBudget"}:
            spec = each["spec"]
            selector = spec.get("podSelector") or spec["selector"]
            selector = selector.get("matchLabels", selector)
            assert selector.items() <= labels[each["metadata"]["name"]].items()


def test_the_operator_is_reached_from_the_monitoring_namespace_only(one):
    """If its egress is restricted, the operator can connect only to the API server and to trainers."""
    open_, closed = one("default", "NetworkPolicy")["spec"], one("closed", "NetworkPolicy")["spec"]

    [source] = open_["ingress"][0]["from"]
    assert source == {"namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": "monitoring"}}}
    assert "egress" not in open_
    assert closed["ingress"] == open_["ingress"]
    assert [[port["port"] for port in rule["ports"]] for rule in closed["egress"]] == [[443, 6443], [9090]]


def test_the_chart_is_of_the_same_release(made):  # noqa: ARG001 - skips without Helm
    """The chart and the packages are released together, so their version numbers must agree."""
    chart = yaml.safe_load((CHART / "Chart.yaml").read_text())

    assert {chart["version"], chart["appVersion"]} == {version("palaestra")}


@every_mode
def test_the_notes_tell_what_to_type_next(mode):
    """After an installation Helm shows only these notes."""
    where = ("palaestra", str(CHART), f"--namespace={NAMESPACE}")
    said = helm("install", *where, "--dry-run=client", "--values=-", sent=yaml.safe_dump(MODES[mode]))

    assert f"helm test palaestra --namespace {NAMESPACE} --timeout 20m" in said
    assert ("kubectl apply --server-side -f manifests/crd.yaml" in said) == ("namespaced" in mode)


def test_notes_and_pages_give_helm_test_the_same_timeout(made):  # noqa: ARG001 - skips without Helm
    """With different timeouts in notes and pages, people asked which one was right."""
    root = CHART.parents[1]
    pages = [(root / "docs/howto/install.md").read_text(), (CHART / "README.md").read_text()]
    pages.append(helm("install", "palaestra", str(CHART), f"--namespace={NAMESPACE}", "--dry-run=client"))

    given = [set(re.findall(r"helm test .*--timeout (\S+)", page)) for page in pages]

    assert given == [{"20m"}] * 3


def test_the_token_of_the_notebooks_can_stand_in_an_address():
    """The base64 characters `+`, `/` and `=` broke the link with `?token=`, so the token is hexadecimal."""
    page = (CHART.parents[1] / "docs/howto/install.md").read_text()
    [command] = re.findall(r'--from-literal=token="\$\((.+)\)"', page)

    token = subprocess.run(["bash", "-c", command], check=True, capture_output=True, text=True).stdout

    assert re.fullmatch("[0-9a-f]{48}", token)


def test_an_old_cluster_is_refused():
    """Sidecar containers are stable only since Kubernetes 1.33."""
    with pytest.raises(HelmRefused, match=r"kubeVersion: >=1\.33\.0-0"):
        helm("template", "palaestra", str(CHART), "--kube-version=1.32.0")
