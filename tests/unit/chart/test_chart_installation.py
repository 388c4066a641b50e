"""The objects of manifests/install.yaml, read from the committed file, so these tests run without Helm."""

from importlib.metadata import version

import pytest

from palaestra.api.crd import crd
from palaestra.operator.options import DEFAULT_NAMESPACE, NAME
from tests.chart.installation import installed


@pytest.fixture(autouse=True)
def helm_is_built():
    """Override the fixture of the folder, because these tests do not need Helm."""


@pytest.fixture
def made():
    """Return the objects of an installation by kind and name."""
    return {(each["kind"], each["metadata"]["name"]): each for each in installed()}


def verbs(role, resource):
    """Return the verbs that a role allows for a kind of objects."""
    return {verb for rule in role["rules"] if resource in rule["resources"] for verb in rule["verbs"]}


def test_what_others_need_is_made_before_them(made):
    """`kubectl apply -f` creates the objects from top to bottom and does not retry."""
    kinds = [kind for kind, _ in made]

    assert kinds[0] == "Namespace"
    assert kinds[-1] == "Deployment"


def test_everything_is_in_the_namespace_that_the_operator_takes_for_its_own(made):
    """Trainers accept requests only from an operator in that namespace."""
    namespaces = {each["metadata"].get("namespace", DEFAULT_NAMESPACE) for each in made.values()}

    assert namespaces == {DEFAULT_NAMESPACE}
    assert ("Namespace", DEFAULT_NAMESPACE) in made


def test_its_namespace_enforces_the_restricted_standard(made):
    """With this label the API server refuses every pod that does not meet the standard."""
    labels = made["Namespace", DEFAULT_NAMESPACE]["metadata"]["labels"]

    assert labels["pod-security.kubernetes.io/enforce"] == "restricted"


def test_nothing_of_helm_test_is_in_it(made):
    """Without Helm nobody runs the test, so its service account would have unused permissions."""
    assert {
        each["metadata"].get("labels", {}).get("app.kubernetes.io/component") for each in made.values()
    } == {
        None,
        "operator",
    }


def test_the_operator_is_that_of_the_release(made):
    """The image tag is never `latest`, so that the operator is upgraded only when a person decides it."""
    [container] = made["Deployment", NAME]["spec"]["template"]["spec"]["containers"]

    assert container["image"] == f"palaestra-operator:{version('palaestra')}"


def test_the_definition_is_that_of_the_models(made):
    """If the models change, somebody must generate install.yaml again."""
    assert made["CustomResourceDefinition", "trainingjobs.palaestra.dev"] == crd()


def test_the_operator_makes_no_pod_itself(made):
    """The operator creates Jobs, and Kubernetes creates, counts, replaces and deletes their pods."""
    assert verbs(made["ClusterRole", NAME], "pods") == {"list", "watch"}
    assert verbs(made["ClusterRole", NAME], "pods/eviction") == {"create"}


def test_nothing_needs_what_a_plain_cluster_lacks(made):
    """Only the Prometheus Operator defines monitors and rules, so a plain cluster would refuse the file."""
    assert [kind for kind, _ in made if kind.endswith(("Monitor", "PrometheusRule"))] == []


def test_nothing_of_helm_test_is_left_in_it(made):
    """Only Helm deletes the objects of its hook, so they would stay in a cluster without Helm."""
    assert [name for _, name in made if "test" in name] == []
