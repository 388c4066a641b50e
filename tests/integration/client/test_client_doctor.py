"""The doctor against a real API server: each problem has a finding with a remedy."""

from importlib.metadata import version

import pytest

from palaestra.cli import main
from palaestra.cluster import Leadership, Resource, connect
from palaestra.cluster.resources import DEPLOYMENTS, NODES, STORAGE_CLASSES
from palaestra.doctor import CheckStatus, Site, examine
from palaestra.doctor.installation import trainer_image
from palaestra.operator.options import NAME
from palaestra.plan import Images
from tests.waiting import eventually

POLICIES = Resource(
    api_version="admissionregistration.k8s.io/v1",
    kind="MutatingAdmissionPolicy",
    plural="mutatingadmissionpolicies",
    namespaced=False,
)
BINDINGS = Resource(
    api_version=POLICIES.api_version,
    kind="MutatingAdmissionPolicyBinding",
    plural="mutatingadmissionpolicybindings",
    namespaced=False,
)

QUOTAS = Resource(api_version="v1", kind="ResourceQuota", plural="resourcequotas")
ACCOUNTS = Resource(api_version="v1", kind="ServiceAccount", plural="serviceaccounts")


@pytest.fixture
def found(place):
    """Return a function that returns the doctor's findings by name, for the test's namespace alone."""
    eventually(lambda: place.get(ACCOUNTS, "default"))  # the API server refuses pods without this account

    def look(api=None):
        site = Site(api=api or place.api, namespace=place.name, operator_namespace=place.name)
        return {each.what: each for each in examine(site)}

    return look


def verdicts(findings):
    """Return the verdict of each finding, by name."""
    return {what: each.verdict.value for what, each in findings.items()}


def test_missing_nodes_storage_and_operator_are_reported(found):
    """A user must get a remedy for each problem, and no false alarm about the rest."""
    findings = found()

    assert verdicts(findings) == {
        "API server": "ok",
        "nodes": "wrong",
        "TrainingJobs": "ok",
        "namespace": "ok",
        "to read jobs": "ok",
        "to author jobs": "ok",
        "to read logs": "ok",
        "to view simulators": "ok",
        "to fetch runs": "ok",
        "sidecars": "ok",
        "storage class": "wrong",
        "operator": "wrong",
        "leader": "wrong",
        "operator's rights": "wrong",
        "metrics": "wrong",
    }
    assert all(each.remedy for each in findings.values() if each.verdict is not CheckStatus.RIGHT)
    assert "get trainingjobs" in findings["operator's rights"].fact


def test_the_command_ends_with_1_if_anything_is_wrong(typed, place):
    """A script uses the exit code, and a user finds each remedy on a line of its own."""
    code, out, _ = typed("doctor", f"--operator-namespace={place.name}")

    assert code == 1
    assert len([line for line in out if line.startswith("wrong")]) >= 5
    assert any(line.strip().startswith("-> install Palaestra") for line in out)


def test_an_api_server_that_does_not_answer_is_the_only_finding(tmp_path, capsys):
    """Without the API server, all other findings would repeat the same error."""
    kubeconfig = tmp_path / "kubeconfig"
    kubeconfig.write_text(
        "{current-context: a, contexts: [{name: a, context: {cluster: c, user: u}}],"
        " clusters: [{name: c, cluster: {server: 'http://127.0.0.1:1'}}], users: [{name: u, user: {}}]}"
    )

    assert main(["doctor", f"--kubeconfig={kubeconfig}"]) == 1
    [line, remedy] = capsys.readouterr().out.splitlines()
    assert line.startswith("wrong    API server")
    assert "->" in remedy


def test_a_node_a_class_and_a_leader_that_are_there_are_right(found, place):
    """An operator counts as leader only while it renews its Lease."""
    node = {"metadata": {"name": f"node-{place.name}"}, "apiVersion": "v1", "kind": "Node"}
    place.api.create(NODES, node)
    place.api.merge(
        NODES,
        None,
        node["metadata"]["name"],
        {"status": {"nodeInfo": {"kubeletVersion": "v1.36.0"}}},
        subresource="status",
    )
    annotations = {"storageclass.kubernetes.io/is-default-class": "true"}
    place.api.create(
        STORAGE_CLASSES,
        {
            "apiVersion": "storage.k8s.io/v1",
            "kind": "StorageClass",
            "metadata": {"name": "usual", "annotations": annotations},
            "provisioner": "nobody.example.com",
        },
    )
    leadership = Leadership(place.api, place.name, NAME, "me")
    leadership.start()
    eventually(leadership.leads)

    findings = found()

    leadership.stop(5.0)
    place.api.delete(NODES, None, node["metadata"]["name"])
    place.api.delete(STORAGE_CLASSES, None, "usual")
    assert findings["nodes"].fact == "v1.36.0 supports sidecar containers"
    assert findings["storage class"].fact == "usual is the default"
    assert findings["leader"].fact == "is me"


def install(place, *, replicas=1, **container):
    """Create the operator's Deployment, for which no controller creates pods."""
    container = {"name": "operator", "image": "palaestra-operator:0.0.0"} | container
    labels = {"a": "b"}
    template = {
        "metadata": {"labels": labels},
        "spec": {"containers": [container], "serviceAccountName": "chosen"},
    }
    place.create(
        DEPLOYMENTS,
        {
            "apiVersion": "apps/v1",
            "kind": "Deployment",
            "metadata": {"name": NAME},
            "spec": {"replicas": replicas, "selector": {"matchLabels": labels}, "template": template},
        },
    )


def test_the_finding_about_an_operator_that_is_not_ready_names_its_image(found, place):
    """A wrong image is a frequent cause, and the log of the operator shows other causes."""
    install(place)

    findings = found()

    assert findings["operator"].verdict is CheckStatus.WRONG
    assert "0 of 1 are ready" in findings["operator"].fact
    assert "palaestra-operator:0.0.0" in findings["operator"].fact
    assert "service account chosen may not" in findings["operator's rights"].fact


def test_the_finding_about_an_operator_at_0_replicas_has_the_command_that_scales_it(found, place):
    """No pod exists whose log could explain the missing leader, so the remedy is one command."""
    install(place, replicas=0)

    findings = found()

    told = [findings[what] for what in ("operator", "leader", "metrics")]
    scale = f"`kubectl scale -n {place.name} deployment/palaestra-operator --replicas=1`"
    assert [(each.verdict, each.remedy) for each in told] == [(CheckStatus.WRONG, scale)] * 3
    assert told[0].fact.startswith(f"is scaled to 0 in {place.name}")


def test_the_finding_about_a_missing_namespace_shows_how_to_make_or_choose_one(place):
    """RBAC allows requests in a missing namespace, so without this finding a user sees only `not found`."""
    site = Site(api=place.api, namespace="nosuch", operator_namespace=place.name)

    findings = {each.what: each for each in examine(site)}

    assert findings["namespace"].verdict is CheckStatus.WRONG
    assert findings["namespace"].fact == "nosuch does not exist"
    assert "`kubectl create namespace nosuch`" in findings["namespace"].remedy
    assert "-n" in findings["namespace"].remedy
    assert "nosuch" not in " ".join(each.fact for what, each in findings.items() if what != "namespace")


def test_a_pod_is_tried_with_the_image_that_the_operator_gives(place):
    """If only a private registry is allowed, another image would be refused although jobs work."""
    site = Site(api=place.api, namespace=place.name, operator_namespace=place.name)
    before = trainer_image(site)

    install(place, command=["palaestra", "operator", "--trainer-image=registry.example.com/trainer:1"])

    assert before == Images.of_release(version("palaestra")).trainer
    assert trainer_image(site) == "registry.example.com/trainer:1"


def test_what_a_person_may_not_do_is_named_and_what_cannot_be_seen_is_unknown(found, control_plane, place):
    """The doctor asks the API server, so all roles, groups and authorizers are considered."""
    nobody = connect(str(control_plane.kubeconfig_of("nobody")))

    findings = found(nobody)

    nobody.close()
    assert findings["to read jobs"].verdict is CheckStatus.WRONG
    assert "get trainingjobs, list trainingjobs, watch trainingjobs" in findings["to read jobs"].fact
    assert findings["to author jobs"].verdict is CheckStatus.WRONG
    assert findings["to read logs"].verdict is CheckStatus.UNKNOWN  # not every user needs this permission
    assert findings["to view simulators"].verdict is CheckStatus.UNKNOWN
    assert findings["to fetch runs"].verdict is CheckStatus.UNKNOWN
    assert "create pods/exec" in findings["to fetch runs"].fact
    assert findings["storage class"].verdict is CheckStatus.UNKNOWN
    assert findings["sidecars"].verdict is CheckStatus.UNKNOWN
    assert place.name in findings["to read jobs"].fact


def test_a_quota_with_room_is_no_hindrance_and_a_spent_one_hides_what_follows(found, place):
    """A quota requires requests and limits of every pod, so the doctor's test pod must have them."""
    quota = {"apiVersion": "v1", "kind": "ResourceQuota", "metadata": {"name": "few"}}
    room = {"requests.cpu": "1", "requests.memory": "1Gi", "limits.memory": "1Gi", "pods": "1"}
    place.create(QUOTAS, quota | {"spec": {"hard": room}})
    eventually(lambda: place.get(QUOTAS, "few")["status"].get("hard") == room)
    with_room = found()["sidecars"]

    place.api.merge(QUOTAS, place.name, "few", {"spec": {"hard": {"pods": "0"}}})
    spent = eventually(lambda: (each := found()["sidecars"]).verdict is not CheckStatus.RIGHT and each)

    assert with_room.fact == "stay unchanged when a pod is created"
    assert spent.verdict is CheckStatus.UNKNOWN
    assert "exceeded quota: few" in spent.fact
    assert spent.remedy == "try again when the quota has room"


def test_something_that_drops_restart_policy_is_found_by_a_dry_run(found, place):
    """An old mutating webhook drops the unknown field. In this test, a policy stands in for the webhook."""
    expression = 'JSONPatch{op: "remove", path: "/spec/initContainers/0/restartPolicy"}'
    rule = {"apiGroups": [""], "apiVersions": ["v1"], "operations": ["CREATE"], "resources": ["pods"]}
    only_here = {"matchLabels": {"kubernetes.io/metadata.name": place.name}}
    place.api.create(
        POLICIES,
        {
            "apiVersion": POLICIES.api_version,
            "kind": POLICIES.kind,
            "metadata": {"name": "old"},
            "spec": {
                "matchConstraints": {"resourceRules": [rule], "namespaceSelector": only_here},
                "reinvocationPolicy": "Never",
                "failurePolicy": "Fail",
                "mutations": [{"patchType": "JSONPatch", "jsonPatch": {"expression": f"[{expression}]"}}],
            },
        },
    )
    place.api.create(
        BINDINGS,
        {
            "apiVersion": BINDINGS.api_version,
            "kind": BINDINGS.kind,
            "metadata": {"name": "old"},
            "spec": {"policyName": "old"},
        },
    )

    found_out = eventually(
        lambda: (each := found()["sidecars"]).verdict is CheckStatus.WRONG and each
    )  # the API server applies a new policy after a moment

    place.api.delete(BINDINGS, None, "old")
    place.api.delete(POLICIES, None, "old")
    assert "drops restartPolicy" in found_out.fact
    assert "mutatingwebhookconfigurations" in found_out.remedy
