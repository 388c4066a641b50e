"""A real API server accepts every object of the chart and of the examples for a platform."""

import json

import pytest

from tests.chart.helm import ROOT, rendered
from tests.chart.modes import MODES
from tests.integration.chart.conftest import NAMESPACES
from tests.waiting import eventually

PLATFORM = sorted((ROOT / "manifests" / "examples" / "platform").glob("*.yaml"))
DRY = ("apply", "--server-side", "--force-conflicts", "--dry-run=server", "--validate=strict", "-f", "-")


@pytest.fixture
def accounts(places, kubectl):  # noqa: ARG001 - they must exist
    """Create the service account of `helm test` in each namespace.

    Without the account, the API server refuses the pod, and a dry run does not create the account.
    """
    for name in NAMESPACES:
        account = {"name": "palaestra-trial", "namespace": name}
        sent = {"apiVersion": "v1", "kind": "ServiceAccount", "metadata": account}
        kubectl("apply", "--server-side", "-f", "-", sent=json.dumps(sent))


@pytest.mark.parametrize("mode", MODES)
def test_an_api_server_takes_every_mode(mode, accounts, kubectl):  # noqa: ARG001 - they must exist
    """Unknown fields and all warnings are errors, including warnings about pods that violate *restricted*."""
    said = kubectl(*DRY, sent=rendered(MODES[mode]))

    assert said.count("serverside-applied (server dry run)") >= 9
    assert "Warning" not in said


@pytest.mark.parametrize("path", PLATFORM, ids=lambda path: path.stem)
def test_an_api_server_takes_an_example_for_the_platform(path, places, kubectl):  # noqa: ARG001 - as above
    """Users copy the examples, change some fields, and apply them."""
    said = kubectl(*DRY, sent=path.read_text())

    assert "Warning" not in said


@pytest.mark.parametrize("path", PLATFORM, ids=lambda path: path.stem)
def test_an_example_says_what_each_object_is_for(path):
    """A user needs an explanation to know which objects to change."""
    for document in path.read_text().split("---\n"):
        assert document.lstrip().startswith("# ")


def test_authors_train_and_readers_look_on(cluster, places, kubectl):  # noqa: ARG001 - as above
    """The example roles.yaml adds TrainingJobs to the cluster roles `edit` and `view` of Kubernetes.

    A user with only the role `palaestra-author` of this file may create TrainingJobs, but no pods.
    """
    (roles,) = (path for path in PLATFORM if path.stem == "roles")
    kubectl("apply", "-f", str(roles), "-f", str(ROOT / "manifests" / "crd.yaml"))
    for role, user in (("edit", "editor"), ("view", "viewer")):
        kubectl("create", "rolebinding", role, f"--clusterrole={role}", f"--user={user}", "-nrobots")
    trainer = ("--as=somebody", "--as-group=trainers")

    def may(who, verb, *what):
        return cluster.kubectl("auth", "can-i", verb, *what, "-nrobots", *who).stdout.strip() == "yes"

    jobs = "trainingjobs.palaestra.dev"
    assert eventually(lambda: may(["--as=editor"], "create", jobs))
    assert eventually(lambda: may(["--as=viewer"], "watch", jobs))
    assert not may(["--as=viewer"], "create", jobs)
    assert may(trainer, "create", jobs)
    assert not may(trainer, "create", "pods")
    assert not may(trainer, "patch", jobs, "--subresource=status")
