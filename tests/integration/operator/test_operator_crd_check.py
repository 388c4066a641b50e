"""An operator in a cluster that has the TrainingJob definition of another release."""

import json
from contextlib import suppress

import pytest
import yaml

from palaestra.api.crd import crd
from palaestra.api.job import API_VERSION, KIND
from palaestra.cluster import NotFound, Resource
from tests.control_plane.installing import install
from tests.control_plane.plane import running
from tests.integration.operator.installed import USER
from tests.integration.operator.operators import RunningOperator
from tests.waiting import eventually

DEFINITIONS = Resource(
    api_version="apiextensions.k8s.io/v1", kind="CustomResourceDefinition", plural="customresourcedefinitions"
)
OUTDATED = "palaestra_operator_crd_outdated"
BEFORE = ["Accepted", "Running", "Suspended", "Succeeded", "Failed"]


@pytest.fixture
def older(tmp_path):
    """Yield a control plane whose definition lacks a status field and two types of conditions."""
    definition = json.loads(json.dumps(crd()))
    [version] = definition["spec"]["versions"]
    status = version["schema"]["openAPIV3Schema"]["properties"]["status"]["properties"]
    del status["running"]
    status["conditions"]["items"]["properties"]["type"]["enum"] = BEFORE
    version["additionalPrinterColumns"] = []
    kinds = tmp_path / "crd.yaml"
    kinds.write_text(yaml.safe_dump(definition))
    folder = tmp_path / "plane"
    folder.mkdir()
    with running(folder, kinds=kinds) as plane:
        api = install(plane)
        eventually(lambda: published(api))
        yield plane
        api.close()


def published(api):
    """Return the published schema of TrainingJobs, or None before the API server publishes it."""
    with suppress(NotFound):
        return api.schema(API_VERSION, KIND)
    return None


def test_an_outdated_definition_is_logged_and_measured(older, tmp_path):
    """With an old definition, the API server drops new fields, and an administrator must learn of it.

    This happens with `crds.install: false` if nobody has applied the new definition.
    """
    kubeconfig = older.kubeconfig_of(USER, "system:serviceaccounts")
    operator = RunningOperator(kubeconfig, tmp_path / "operator.log", "--no-leader-elect")
    try:
        [said] = eventually(lambda: operator.said("CustomResourceDefinition outdated"))

        types = "status.conditions[].type: lacks Reconciling, Stalled"
        assert sorted(said["lacks"]) == [types, "status.running: is missing"]
        assert f"{OUTDATED} 1.0" in operator.ask("/metrics").splitlines()
    finally:
        operator.kill()


def test_the_definition_of_this_release_is_asked_for_once(place, start, installed):
    """The installation's permissions suffice to read the schema, and one request is enough."""
    eventually(lambda: published(installed))
    operator = start()
    place.train()

    eventually(lambda: f"{OUTDATED} 0.0" in operator.ask("/metrics").splitlines())
    asked = [line for line in operator.ask("/metrics").splitlines() if 'resource="openapi"' in line]
    assert asked == ['palaestra_operator_requests_total{code="200",resource="openapi",verb="get"} 1.0']
    assert operator.said("CustomResourceDefinition outdated") == []
