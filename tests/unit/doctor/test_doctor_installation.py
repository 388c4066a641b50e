"""The doctor's checks of an operator that does not work, against a fake API server."""

import pytest

from palaestra.cluster import Forbidden, NotFound, Unreachable
from palaestra.cluster.resources import PODS
from palaestra.doctor import CheckStatus, Site
from palaestra.doctor.installation import images, leads, metrics, runs, trainer_image
from palaestra.doctor.platform import definition

POD = {
    "metadata": {"name": "palaestra-operator-x7k2p"},
    "status": {"phase": "Running"},
    "spec": {"containers": [{"ports": [{"name": "metrics", "containerPort": 9090}]}]},
}


class Server:
    """A fake API server.

    Args:
        deployment: the operator's Deployment, or the error that a request for it raises.
        pods: the operator's pods.
        text: the metrics of the operator, or the error that a request for them raises.
    """

    def __init__(self, deployment=None, pods=(), text=""):
        self._deployment = deployment or NotFound(404, "NotFound", "deployments palaestra-operator")
        self._pods, self._text = pods, text
        self.proxied_to = []

    def get(self, *_):
        """Return the Deployment."""
        return answered(self._deployment)

    def list(self, resource, namespace, labels):
        """Return the pods."""
        assert (resource, namespace) == (PODS, "palaestra-system")
        assert labels
        return list(self._pods)

    def proxied(self, namespace, pod, port, path):
        """Return the metrics."""
        self.proxied_to.append((namespace, pod, port, path))
        return answered(self._text)

    def serves(self, _):
        """Return False, as a cluster without the definition of TrainingJobs."""
        return False


def answered(found):
    """Return a prepared response, or raise it."""
    if isinstance(found, Exception):
        raise found
    return found


def deployment(replicas=1, *command, ready=0):
    """Return the operator's Deployment."""
    container = {"image": "operator:1", "command": ["palaestra", "operator", *command]}
    spec = {"replicas": replicas, "template": {"spec": {"containers": [container]}}}
    return {"spec": spec, "status": {"readyReplicas": ready}}


def results(check, *arguments, **options):
    """Return the results of a check for a server with these properties."""
    server = Server(*arguments, **options)
    return list(check(Site(api=server, namespace="lab", operator_namespace="palaestra-system")))


def test_a_missing_operator_is_one_result_and_not_four():
    """A person must install the operator first. Its images and metrics cannot be checked before that."""
    [found] = results(runs)

    assert found.verdict is CheckStatus.WRONG
    assert found.remedy == "install Palaestra, or name its namespace with --operator-namespace"
    assert results(images) == []


@pytest.mark.parametrize("check", [runs, leads])
def test_an_operator_that_is_scaled_to_zero_has_the_command_that_scales_it(check):
    """An administrator may have stopped it for an update and forgotten it."""
    [found] = results(check, deployment(0))

    assert found.verdict is CheckStatus.WRONG
    assert "scaled to 0" in found.fact
    assert found.remedy.startswith("`kubectl scale -n palaestra-system deployment/")


def test_an_operator_without_leader_election_needs_no_lease():
    """A single replica without a Lease is right, although the Lease does not exist."""
    [found] = results(leads, deployment(1, "--no-leader-elect"))

    assert found.verdict is CheckStatus.RIGHT


def test_metrics_without_a_running_operator_have_the_remedy_of_the_operator():
    """An operator without a running pod exports no metrics, so a person must repair it first."""
    [found] = results(metrics, deployment(), [POD | {"status": {"phase": "Pending"}}])

    assert found.verdict is CheckStatus.WRONG
    assert found.fact == "no operator runs in palaestra-system"
    assert "kubectl logs" in found.remedy


def test_metrics_that_the_api_server_cannot_reach_are_unknown():
    """A NetworkPolicy that admits only Prometheus is right, and an error would be a false alarm."""
    [found] = results(metrics, deployment(), [POD], Unreachable(0, "Timeout", "no response in 10 s"))

    assert found.verdict is CheckStatus.UNKNOWN
    assert "port 9090 of pod palaestra-operator-x7k2p does not respond" in found.fact
    assert "NetworkPolicy" in found.remedy


def test_a_user_who_may_not_reach_pods_gets_no_result_about_metrics():
    """The user lacks this permission, and the caller of the check reports it. The operator may be right."""
    with pytest.raises(Forbidden):
        results(metrics, deployment(), [POD], Forbidden(403, "Forbidden", "pods/proxy"))


@pytest.mark.parametrize(
    ("text", "verdict"),
    [("palaestra_jobs 3\n", CheckStatus.RIGHT), ("python_info 1\n", CheckStatus.WRONG)],
)
def test_metrics_are_those_of_palaestra(text, verdict):
    """Another program may have the operator's label and port."""
    [found] = results(metrics, deployment(), [POD], text)

    assert found.verdict is verdict


@pytest.mark.parametrize("hidden", [None, Forbidden(403, "Forbidden", "deployments")])
def test_the_image_of_trainers_is_the_releases_if_the_operator_cannot_be_read(hidden):
    """A student may not read the operator's namespace, but can check the pods of jobs."""
    site = Site(api=Server(hidden), namespace="lab", operator_namespace="palaestra-system")

    assert trainer_image(site).startswith("palaestra-trainer:")


def test_the_image_of_trainers_is_that_of_the_operators_option():
    """The trial pod must use an image that the cluster can pull."""
    server = Server(deployment(1, "--trainer-image=registry.example/own:3"))
    site = Site(api=server, namespace="lab", operator_namespace="palaestra-system")

    assert trainer_image(site) == "registry.example/own:3"


def test_a_cluster_without_the_definition_gets_the_command_that_installs_it():
    """Every other check would fail with a message of Kubernetes about an unknown kind."""
    [found] = results(definition)

    assert found.verdict is CheckStatus.WRONG
    assert "does not serve palaestra.dev/" in found.fact
    assert found.remedy
