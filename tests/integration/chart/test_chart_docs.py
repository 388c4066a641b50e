"""All commands of docs/howto/install.md work as written, in the order of the page."""

import json
import re

import pytest
import yaml

from palaestra.observe.references import FOR_JOBS
from tests.chart.helm import NAMESPACE, ROOT
from tests.control_plane.programs import programs
from tests.integration.chart.conftest import DEFINITION
from tests.pages import blocks
from tests.terminal import Terminal

PAGE = (ROOT / "docs/howto/install.md").read_text()
BLOCKS = blocks(PAGE, "sh")
REGISTRY = blocks(PAGE, "sh with-a-registry")
# Without nodes, no job ends. The operator's tests cover `palaestra try`, and `make e2e` covers `helm test`.
NO_NODES = 'helm() { [[ $1 == test ]] || command helm "$@"; }\n'
AWAY = f"""
helm uninstall palaestra --namespace {NAMESPACE} --ignore-not-found
kubectl delete --ignore-not-found --filename manifests/install.yaml --filename manifests/crd.yaml
kubectl delete --ignore-not-found --filename manifests/examples/platform/roles.yaml
"""
IN_LAB = ("--namespace=lab", "--output=json")
TYPED_S = 120


@pytest.fixture
def typed(cluster, kubectl, tmp_path):
    """Return a function that runs commands in a checkout and returns their output."""
    kubectl("delete", "crd", DEFINITION, "--ignore-not-found")
    for name in (NAMESPACE, "lab", "robots", "drones"):
        kubectl("delete", "namespace", name, "--ignore-not-found", "--wait")
    for name in ("charts", "manifests"):
        (tmp_path / name).symlink_to(ROOT / name)
    path = f"{programs(('helm',))}:{cluster.binaries}"
    terminal = Terminal(tmp_path, path=path, before=NO_NODES, KUBECONFIG=str(cluster.kubeconfig))

    def type_in(text):
        return terminal.type_in(text, TYPED_S)

    yield type_in
    type_in(AWAY)


def test_no_command_for_everybody_names_a_registry_that_is_a_placeholder():
    """An upgrade keeps the values of the installation, and no image can be pulled from a placeholder."""
    assert [block for block in BLOCKS if "registry.example.com" in block] == []
    assert len(REGISTRY) == 1


def test_the_commands_for_a_registry_can_be_typed_after_the_installation(typed, kubectl):
    """The other tests of the page leave out these commands, so only this test executes them."""
    for block in (BLOCKS[0], *REGISTRY):
        typed(block)

    images = kubectl("get", "deployment", f"--namespace={NAMESPACE}", "--output=jsonpath={..image}")
    assert images.startswith("registry.example.com/robots/palaestra-operator@sha256:")


def test_tensorboard_has_a_claim_that_jobs_may_name(typed, kubectl):
    """The page must create the claim, with the label that admits jobs.

    Without the claim, the pod of TensorBoard waits forever. Without the label, the operator holds each job.
    """
    chapter = PAGE[PAGE.index("## TensorBoard and notebooks") : PAGE.index("## Upgrade")]
    [job] = [yaml.safe_load(block) for block in blocks(chapter, "yaml")]

    for block in (BLOCKS[0], *blocks(chapter, "sh")):
        typed(block)

    server = json.loads(kubectl("get", "deployment", "palaestra-tensorboard", *IN_LAB))
    claim = json.loads(kubectl("get", "persistentvolumeclaim", "runs", *IN_LAB))
    volume = server["spec"]["template"]["spec"]["volumes"][0]
    assert job["spec"]["storage"] == {"existingClaim": "runs"}
    assert volume["persistentVolumeClaim"]["claimName"] == "runs"
    assert claim["metadata"]["labels"] == {FOR_JOBS: "true"}


def test_an_uninstalled_palaestra_leaves_nothing_but_claims_of_jobs(typed, kubectl):
    """The page must name every object that Helm keeps: Lease, Secrets, namespace and roles."""
    typed(BLOCKS[0])
    kubectl("create", "secret", "generic", "notebooks", f"--namespace={NAMESPACE}")
    kubectl("create", "namespace", "robots")
    kubectl("apply", "--filename", str(ROOT / "manifests/examples/platform/roles.yaml"))
    chapter = PAGE[PAGE.index("## Uninstall") : PAGE.index("## In some namespaces only")]

    for block in blocks(chapter, "sh"):
        typed(block)

    kinds = "namespaces,clusterroles,clusterrolebindings,roles,rolebindings,customresourcedefinitions"
    left = kubectl("get", kinds, "--all-namespaces", "--output=name")
    assert [name for name in left.split() if "palaestra" in name] == []


def test_the_roles_can_be_typed_after_the_installation_alone(typed, kubectl):
    """The binding of the roles is in a namespace that another chapter creates.

    A reader who has skipped that chapter must be able to run the commands.
    """
    people = PAGE[PAGE.index("## For the people who train") : PAGE.index("## Without Helm")]
    [roles] = blocks(people, "sh")
    [some] = blocks(PAGE[PAGE.index("## In some namespaces only") : PAGE.index("## For the people")], "sh")

    typed(BLOCKS[0])
    typed(roles)
    [again] = [line for line in some.splitlines() if "robots" in line or "namespace.yaml" in line][:1]
    typed(again)

    assert "trainers" in kubectl("get", "rolebindings", "--namespace=robots", "--output=name")


@pytest.mark.timeout(600)
def test_the_page_can_be_typed_from_top_to_bottom(typed):
    """A reader runs all commands in this order and must see no warning.

    At the end, Palaestra is installed without Helm.
    """
    kinds = "Warning:|WARNING"

    said = "".join(typed(block) for block in BLOCKS)

    assert len(BLOCKS) >= 12
    assert [line for line in said.splitlines() if re.match(kinds, line)] == []
    assert typed(f"kubectl get deployment palaestra-operator --namespace {NAMESPACE} --output name")
