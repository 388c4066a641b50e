"""Access to the ports of a training pod, tried in the cluster and computed by cyclonus.

The tests that connect are skipped if the cluster enforces no NetworkPolicies.
"""

import json
import os
import re
import shutil
import subprocess

import pytest

from tests.e2e.askers import LISTEN, Asker
from tests.e2e.jobs import WAIT, tiny_job
from tests.e2e.namespace import LONG_S, OPERATOR, SHORT_S, SYSTEM, NeverHeld, named

pytestmark = pytest.mark.timeout(1200)

STATUS, HEALTH, CONTROL, MASTER = 9090, 7200, 7100, 11311
OPEN = {STATUS, HEALTH, HEALTH + 31}
CLOSED = {CONTROL, MASTER, HEALTH - 1, HEALTH + 100}
VERDICT = re.compile(r"IS ALLOWED\?\s*\|\s*(TRUE|FALSE)")
STOCK = os.environ.get("PALAESTRA_CLUSTER") == "stock"  # kind's own network enforces policies
ANSWERS = f"python3 -c '{LISTEN}' & {WAIT}"  # stands in for the trainer's port of metrics and status
LOOKS = 3  # consecutive refused connections that prove a policy
DENY_ALL = {"metadata": {"name": "deny"}, "spec": {"podSelector": {}, "policyTypes": ["Ingress"]}}


@pytest.fixture(scope="module")
def pod(shared):
    """A pod whose trainer runs, in a namespace with a NetworkPolicy."""
    shared.apply(tiny_job("guarded", script=ANSWERS))
    return shared.get("pods", shared.wait_for_pod("guarded", LONG_S))


@pytest.fixture(scope="session")
def enforced(listener, monitor):
    """Whether the cluster enforces NetworkPolicies; the fixture tries a policy that denies everything.

    Kind's own network enforces policies, but on a busy machine only after a while. A listener without
    processor time accepts no connections either, so it must reach itself, several times.
    """
    space = listener.namespace
    target = space.get("pods", listener.name)
    space.wait(lambda: monitor.reaches(target, STATUS))
    space.create("networkpolicies", DENY_ALL)

    def denied():
        return all(
            not monitor.reaches(target, STATUS) and listener.reaches(target, STATUS) for _ in range(LOOKS)
        )

    try:
        return space.wait(denied, SHORT_S if STOCK else 10)
    except NeverHeld:
        if STOCK:
            raise
        return False


@pytest.fixture(scope="session")
def listener(make_namespace):
    """A pod that listens on a port, in a namespace without other pods."""
    return Asker(make_namespace("control"), "listens", command=["python3", "-c", LISTEN])


def test_ros_and_control_are_on_loopback_and_metrics_are_not(pod, shared, monitor):
    """ROS 1 has no authentication, so its ports must be closed even in a cluster without NetworkPolicies."""
    shared.wait(lambda: monitor.reaches(pod, HEALTH))
    assert not monitor.reaches(pod, CONTROL)
    assert not monitor.reaches(pod, MASTER)


def test_no_stranger_reaches_a_training_pod(pod, shared, make_namespace, monitor, enforced):
    """Users can create pods with any label.

    Neither a pod of the same namespace nor a pod with the operator's label elsewhere may connect.
    """
    if not enforced:
        pytest.skip("this cluster's network enforces no NetworkPolicy: the control pod was reached")
    beside = Asker(shared, "beside")
    elsewhere = Asker(make_namespace("strangers"), "elsewhere", {"palaestra.dev/operator": "true"})

    for port in (HEALTH, STATUS):
        shared.wait(lambda port=port: monitor.reaches(pod, port))
        assert not beside.reaches(pod, port)
        assert not elsewhere.reaches(pod, port)


def test_the_policy_admits_operator_and_monitoring_and_nobody_else(pod, shared, tmp_path):
    """The test evaluates the policy with cyclonus, which is a tool of other authors.

    An error in Palaestra's understanding of policies therefore cannot hide in this test.
    """
    labels = shared.cluster.get("deployments", SYSTEM, OPERATOR)["spec"]["template"]["metadata"]["labels"]
    admitted = [peer(SYSTEM, labels), peer("monitoring", {}), peer("monitoring", {"any": "thing"})]
    strangers = [
        peer("default", {}),
        peer("default", labels),
        peer(SYSTEM, {}),
        peer(shared.name, {}),
        peer(shared.name, labels),
        peer(shared.name, {"palaestra.dev/job": "another"}),
        {"IP": "198.51.100.7"},
    ]
    target = peer(shared.name, pod["metadata"]["labels"])
    asked = [(who, port) for who in [*admitted, *strangers] for port in sorted(OPEN | CLOSED)]

    verdicts = evaluate(shared, tmp_path, [traffic(who, target, port) for who, port in asked])

    assert verdicts == [who in admitted and port in OPEN for who, port in asked]


@pytest.mark.beside
def test_a_job_may_close_the_way_out(namespace, job, tmp_path):
    """With `egress: Closed` the pods can open no connection, but Prometheus can still connect to them."""
    namespace.apply(job("closed", script=WAIT, network={"egress": "Closed"}))
    closed = namespace.get("pods", namespace.wait_for_pod("closed", LONG_S))
    inside = peer(namespace.name, closed["metadata"]["labels"])
    outside, monitoring = {"IP": "198.51.100.7"}, peer("monitoring", {})
    asked = [
        traffic(inside, outside, 443),
        traffic(inside, monitoring, 80),
        traffic(monitoring, inside, STATUS),
    ]

    assert evaluate(namespace, tmp_path, asked) == [False, False, True]


def peer(namespace, labels):
    """Return a pod in the format of cyclonus."""
    own = {"kubernetes.io/metadata.name": namespace}
    return {
        "Internal": {"Namespace": namespace, "NamespaceLabels": own, "PodLabels": labels},
        "IP": "198.18.0.9",
    }


def traffic(source, destination, port):
    """Return a connection in the format of cyclonus."""
    return {"Source": source, "Destination": destination, "ResolvedPort": port, "Protocol": "TCP"}


def evaluate(namespace, folder, asked):
    """Return, for each connection, whether the NetworkPolicies of the namespace allow it."""
    cyclonus = shutil.which("cyclonus")
    assert cyclonus, "cyclonus is not on the PATH; `tests/cluster/programs.sh cyclonus` builds it"
    policies = namespace.select("networkpolicies")
    assert policies
    for each in policies:
        each.pop("status", None)
        each |= {"apiVersion": "networking.k8s.io/v1", "kind": "NetworkPolicy"}
        (folder / "policies").mkdir(exist_ok=True)
        (folder / "policies" / f"{named(each)}.yaml").write_text(json.dumps(each))
    (folder / "traffic.json").write_text(json.dumps(asked))
    command = [cyclonus, "analyze", "--mode=query-traffic", f"--policy-path={folder / 'policies'}"]
    ended = subprocess.run(
        [*command, f"--traffic-path={folder / 'traffic.json'}"], capture_output=True, text=True, check=True
    )
    return [verdict == "TRUE" for verdict in VERDICT.findall(ended.stdout)]
