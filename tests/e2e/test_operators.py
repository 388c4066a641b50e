"""Operators start and stop: several at once, a successor of a killed leader, and an upgrade."""

import copy
import os
from importlib.metadata import version

import pytest

from tests.e2e.jobs import WAIT
from tests.e2e.long_run import kill_operator, make_killable, operators
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM, named, statuses

pytestmark = [pytest.mark.changes_the_operator, pytest.mark.timeout(1200)]

NEXT_IMAGE = os.environ.get("PALAESTRA_E2E_NEXT_OPERATOR", "palaestra-operator:next")
TRAINER_IMAGE = f"palaestra-trainer:{version('palaestra')}"
MANY = 3
KINDS = ("jobs", "pods", "configmaps", "persistentvolumeclaims", "networkpolicies")


@pytest.fixture
def deployment(cluster):
    """The operator's Deployment, which is restored at the end."""
    found = cluster.get("deployments", SYSTEM, OPERATOR)
    yield found
    spec = copy.deepcopy(found["spec"])
    spec["template"]["spec"].setdefault("shareProcessNamespace", None)
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": spec})
    cluster.rolled_out(SYSTEM, OPERATOR)


def change(cluster, deployment, *options, **container):
    """Add options to the operator's command, and set other fields of its container."""
    wanted = copy.deepcopy(deployment["spec"]["template"]["spec"]["containers"][0]) | container
    wanted["command"] = [*wanted["command"], *options]
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"template": {"spec": {"containers": [wanted]}}}})
    cluster.rolled_out(SYSTEM, OPERATOR)


def holder(cluster):
    """Return the holder of the Lease."""
    lease = cluster.get("leases", SYSTEM, OPERATOR) or {"spec": {}}
    return lease["spec"].get("holderIdentity") or ""


def test_two_operators_at_once_make_no_second_pod(deployment, namespace, cluster, job):
    """Unique names prevent duplicates even if three operators act without an election, as in this test."""
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 3}})
    change(cluster, deployment, "--no-leader-elect")
    assert len(operators(namespace)) == 3

    names = [f"race-{number}" for number in range(MANY)]
    for name in names:
        namespace.apply(job(name, script="exit 0"))

    for name in names:
        assert namespace.wait_for_end(name, LONG_S) == "Succeeded"
        assert {kind: len(namespace.select(kind, name)) for kind in KINDS} == dict.fromkeys(KINDS, 1)
        assert namespace.pods_made(name) == 1


def test_another_operator_takes_over_when_the_leader_is_gone(deployment, namespace, cluster, job):  # noqa: ARG001 - is put back
    """A killed leader keeps its Lease until the Lease expires, but a stopped leader releases it at once."""
    make_killable(namespace)
    cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"replicas": 2}})
    cluster.rolled_out(SYSTEM, OPERATOR)
    first = namespace.wait(lambda: _leader(namespace))

    assert kill_operator(namespace, first)
    namespace.apply(job("orphan", script="exit 0"))
    second = namespace.wait(lambda: (now := _leader(namespace)) != first and now)
    assert namespace.wait_for_end("orphan") == "Succeeded"

    cluster.delete("pods", SYSTEM, second)
    namespace.wait(lambda: _leader(namespace) not in {"", first, second}, 15)


def _leader(namespace):
    """Return the name of the operator pod that holds the Lease, or ""."""
    who = holder(namespace.cluster)
    return next((named(pod) for pod in operators(namespace) if who.startswith(named(pod))), "")


def test_an_upgrade_of_the_operator_touches_no_running_pod(deployment, namespace, cluster, job):
    """The new operator keeps existing objects, and uses the defaults of the release that accepted the job."""
    namespace.apply(job("stays", script=WAIT))
    namespace.wait_for_pod("stays", LONG_S)
    namespace.wait(lambda: namespace.status("stays").get("phase") == "Running")
    before = {kind: fingerprint(namespace, kind) for kind in KINDS}

    change(cluster, deployment, "--trainer-image=palaestra-trainer:next", image=NEXT_IMAGE)
    namespace.apply(job("later", trainer={"image": TRAINER_IMAGE}, script="exit 0"))
    assert namespace.wait_for_end("later", LONG_S) == "Succeeded"

    assert {each["spec"]["containers"][0]["image"] for each in operators(namespace)} == {NEXT_IMAGE}
    assert {kind: fingerprint(namespace, kind) for kind in KINDS} == before
    assert namespace.status("stays")["phase"] == "Running"


def fingerprint(namespace, kind):
    """Return uid, generation and containers of the job's objects.

    The result changes if a controller updates an object or if a container restarts.
    """
    found = namespace.select(kind, "stays")
    return {
        (each["metadata"]["uid"], each["metadata"].get("generation"), *containers(each)) for each in found
    }


def containers(content):
    """Return the id and the restart count of each container in an object's status."""
    return [(each.get("containerID"), each["restartCount"]) for each in statuses(content)]
