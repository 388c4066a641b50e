"""What an installation holds, and what it must not."""

import pytest

from palaestra.manifests import NAME, install


@pytest.fixture
def made():
    """The objects of an installation by kind and name."""
    return {(each["kind"], each["metadata"]["name"]): each for each in install("1.2.3")}


def pod_of(made):
    """Return the operator's pod."""
    return made["Deployment", NAME]["spec"]["template"]["spec"]


def rules(role):
    """Return (group, resource, verb) of all that a role allows."""
    return [
        (group, resource, verb)
        for rule in role["rules"]
        for group in rule["apiGroups"]
        for resource in rule["resources"]
        for verb in rule["verbs"]
    ]


def test_what_others_need_is_made_before_them(made):
    """`kubectl apply -f` goes from top to bottom, once."""
    kinds = [kind for kind, _ in made]

    assert kinds[:3] == ["Namespace", "CustomResourceDefinition", "ServiceAccount"]
    assert kinds[-1] == "Deployment"


def test_the_operator_is_that_of_the_release(made):
    """Never `latest`: an upgrade is somebody's decision."""
    [container] = pod_of(made)["containers"]

    assert container["image"] == "palaestra-operator:1.2.3"


def test_the_operator_meets_the_restricted_standard_in_a_namespace_that_enforces_it(made):
    """Its own namespace refuses everything else."""
    pod, [container] = pod_of(made), pod_of(made)["containers"]
    security = container["securityContext"]

    namespace = made["Namespace", "palaestra-system"]
    assert namespace["metadata"]["labels"]["pod-security.kubernetes.io/enforce"] == "restricted"
    assert pod["securityContext"]["runAsNonRoot"] is True
    assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    assert security["readOnlyRootFilesystem"] is True
    assert security["allowPrivilegeEscalation"] is False
    assert security["capabilities"] == {"drop": ["ALL"]}


def test_no_binding_lets_the_operator_read_a_secret(made):
    """RBAC knows no labels, so a person chooses the namespaces."""
    bound = {each["roleRef"]["name"] for (kind, _), each in made.items() if kind.endswith("Binding")}
    roles = [each for (kind, name), each in made.items() if kind.endswith("Role") and name in bound]

    assert roles
    assert not [rule for role in roles for rule in rules(role) if "secrets" in rule]


def test_no_role_has_a_wildcard(made):
    """What is used is known, verb by verb."""
    roles = [each for (kind, _), each in made.items() if kind.endswith("Role")]

    assert not [rule for role in roles for rule in rules(role) if "*" in rule]


def test_the_operator_makes_no_pod_itself(made):
    """Pods are made by Jobs, so that Kubernetes counts, replaces and cleans them up."""
    verbs = {verb for _, resource, verb in rules(made["ClusterRole", NAME]) if resource == "pods"}

    assert verbs == {"list", "watch"}
