"""What manifests/install.yaml holds, and what it must not; read as it is recorded, so without Helm."""

from importlib.metadata import version

import pytest

from palaestra.api.crd import crd
from palaestra.operator.options import DEFAULT_NAMESPACE, NAME
from tests.chart.installation import installed


@pytest.fixture(autouse=True)
def helm_is_built():
    """Needed by the other tests of this folder only."""


@pytest.fixture
def made():
    """The objects of an installation by kind and name."""
    return {(each["kind"], each["metadata"]["name"]): each for each in installed()}


def verbs(role, resource):
    """Return what a role allows to do with a kind of objects."""
    return {verb for rule in role["rules"] if resource in rule["resources"] for verb in rule["verbs"]}


def test_what_others_need_is_made_before_them(made):
    """`kubectl apply -f` goes from top to bottom, once."""
    kinds = [kind for kind, _ in made]

    assert kinds[0] == "Namespace"
    assert kinds[-1] == "Deployment"


def test_everything_is_in_the_namespace_that_the_operator_takes_for_its_own(made):
    """Trainers let in the operator of that namespace."""
    namespaces = {each["metadata"].get("namespace", DEFAULT_NAMESPACE) for each in made.values()}

    assert namespaces == {DEFAULT_NAMESPACE}
    assert ("Namespace", DEFAULT_NAMESPACE) in made


def test_its_namespace_enforces_the_restricted_standard(made):
    """It refuses everything else."""
    labels = made["Namespace", DEFAULT_NAMESPACE]["metadata"]["labels"]

    assert labels["pod-security.kubernetes.io/enforce"] == "restricted"


def test_nothing_of_helm_test_is_in_it(made):
    """Only Helm can run it, so without Helm its account would hold rights that nothing uses."""
    assert {
        each["metadata"].get("labels", {}).get("app.kubernetes.io/component") for each in made.values()
    } == {
        None,
        "operator",
    }


def test_the_operator_is_that_of_the_release(made):
    """Never `latest`: an upgrade is somebody's decision."""
    [container] = made["Deployment", NAME]["spec"]["template"]["spec"]["containers"]

    assert container["image"] == f"palaestra-operator:{version('palaestra')}"


def test_the_definition_is_that_of_the_models(made):
    """A change of the models requires a new recording of the definition."""
    assert made["CustomResourceDefinition", "trainingjobs.palaestra.dev"] == crd()


def test_the_operator_makes_no_pod_itself(made):
    """Pods are made by Jobs, so that Kubernetes counts, replaces and cleans them up."""
    assert verbs(made["ClusterRole", NAME], "pods") == {"list", "watch"}
    assert verbs(made["ClusterRole", NAME], "pods/eviction") == {"create"}


def test_nothing_needs_what_a_plain_cluster_lacks(made):
    """Prometheus' kinds come with the Prometheus Operator."""
    assert [kind for kind, _ in made if kind.endswith(("Monitor", "PrometheusRule"))] == []


def test_nothing_of_helm_test_is_left_in_it(made):
    """A hook without Helm would be an object for ever."""
    assert [name for _, name in made if "test" in name] == []
