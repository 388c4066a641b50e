"""The permissions that roles grant, and the permissions that an audit log shows in use."""

import json

import pytest

from tests.chart.installation import installed
from tests.chart.rights import Right, Use, granted, uses

READ = Right("", "pods", "list")
WHY = 'RBAC: allowed by RoleBinding "reader/robots"'


@pytest.fixture(autouse=True)
def helm_is_built():
    """Override the fixture of the folder, because these tests do not need Helm."""


def role(name, namespace=None, verb="list"):
    """Return a ClusterRole, or a Role in a namespace, that allows one verb on pods."""
    metadata = {"name": name} | ({"namespace": namespace} if namespace else {})
    rules = [{"apiGroups": [""], "resources": ["pods"], "verbs": [verb]}]
    return {"kind": "Role" if namespace else "ClusterRole", "metadata": metadata, "rules": rules}


def binding(of, account="operator"):
    """Return the binding of a role to a service account of the namespace `robots`."""
    subject = {"kind": "ServiceAccount", "name": account, "namespace": "robots"}
    reference = {"kind": of["kind"], "name": of["metadata"]["name"]}
    return {
        "kind": f"{of['kind']}Binding",
        "metadata": of["metadata"],
        "roleRef": reference,
        "subjects": [subject],
    }


def entry(verb, *, user="system:serviceaccount:robots:operator", code=200, decision="allow", **target):
    """Return a line of an audit log."""
    return json.dumps(
        {
            "verb": verb,
            "user": {"username": user},
            "requestReceivedTimestamp": "2026-01-02T00:00:00.000001Z",
            "objectRef": {"resource": "pods", "namespace": "robots", **target},
            "responseStatus": {"code": code},
            "annotations": {
                "authorization.k8s.io/decision": decision,
                "authorization.k8s.io/reason": WHY,
            },
        }
    )


def test_a_right_is_granted_by_a_binding_and_not_by_a_role_alone():
    """Kubernetes grants the permissions of a role only to the subjects of its bindings."""
    bound, alone = role("reads"), role("deletes", verb="delete")

    assert granted([bound, alone, binding(bound)], "robots", "operator") == {READ}


def test_roles_of_one_name_are_distinguished_by_their_namespaces():
    """With a list of watched namespaces, the chart creates a role of the same name in each."""
    here, there = role("jobs", "robots"), role("jobs", "drones", "delete")

    assert granted([here, there, binding(here)], "robots", "operator") == {READ}


def test_what_another_account_holds_is_not_granted():
    """A service account of the same name in another namespace is another account."""
    bound = role("reads")

    assert granted([bound, binding(bound, "trial")], "robots", "operator") == set()
    assert granted([bound, binding(bound)], "drones", "operator") == set()


def test_the_installation_grants_no_secrets_though_a_role_for_them_is_in_it():
    """The role grants nothing until somebody binds it to the operator's account."""
    rights = granted(installed(), "palaestra-system", "palaestra-operator")

    assert rights
    assert "secrets" not in {right.resource for right in rights}


def test_a_request_is_the_use_of_a_right():
    """A logged request shows that a permission is in use.

    The use contains the subresource and the API server's reason to allow the request.
    """
    log = entry("patch", apiGroup="palaestra.dev", resource="trainingjobs", subresource="status")

    right = Right("palaestra.dev", "trainingjobs/status", "patch")
    assert list(uses(log)) == [Use("robots", "operator", right, allowed=True, reason=WHY)]


def test_applying_an_object_that_does_not_exist_yet_uses_two_rights():
    """An API server checks `patch` and `create`, and logs only `patch`."""
    verbs = {code: [use.right.verb for use in uses(entry("patch", code=code))] for code in (200, 201)}

    assert verbs == {200: ["patch"], 201: ["patch", "create"]}


def test_a_refused_request_is_no_right():
    """The log also contains refused requests, for which the account lacks the permission."""
    [use] = uses(entry("list", decision="forbid", code=403))

    assert not use.allowed


def test_people_discovery_the_past_and_half_a_line_are_left_out():
    """A use is a complete request of a service account for an object, logged after the given time."""
    discovery = json.loads(entry("get"))
    del discovery["objectRef"]
    lines = [entry("list", user="admin"), json.dumps(discovery), entry("list"), '{"verb": "li']

    assert [use.right for use in uses("\n".join(lines))] == [READ]
    assert list(uses(entry("list"), since="2026-01-03")) == []
