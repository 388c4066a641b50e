"""What the launcher for pods refuses, against an API server whose responses a test prepares."""

import re
from pathlib import Path

import pytest

from palaestra_protocol.xmlrpc.server import RpcServer
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching import kubernetes_api
from palaestra_trainer.webots.launching.kubernetes_api import PODS, NamespaceClient
from palaestra_trainer.webots.launching.kubernetes_pod import PodSettings, start_pod
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest
from tests.integration.apiserver.conftest import write_kubeconfig
from tests.integration.apiserver.server import hang_up, raw, reply, serving

NOWHERE = "http://127.0.0.1:1"
NOTEBOOK = {
    "metadata": {"name": "notebook-0", "uid": "7", "labels": {"app": "jupyter"}},
    "spec": {"containers": [{"name": "jupyter", "image": "registry.example/palaestra-notebook:9"}]},
}
SETTINGS = PodSettings(image=None, resources={}, start_s=1.0, silence_s=10, lifetime_s=60)


@pytest.fixture
def server(monkeypatch, tmp_path):
    """Yield the script of an API server that this program finds by a kubeconfig."""
    with serving() as (address, script):
        monkeypatch.setenv("KUBECONFIG", write_kubeconfig(tmp_path / "kubeconfig", address, {"token": "x"}))
        # kubernetes.config reads the variable at its import.
        monkeypatch.setattr(
            "kubernetes.config.kube_config.KUBE_CONFIG_DEFAULT_LOCATION", str(tmp_path / "kubeconfig")
        )
        monkeypatch.setenv("PALAESTRA_NAMESPACE", "lab")
        monkeypatch.setenv("PALAESTRA_POD", "notebook-0")
        monkeypatch.setenv("ROS_MASTER_URI", NOWHERE)
        script.calls = [reply(200, NOTEBOOK)]
        yield script


@pytest.mark.parametrize(
    ("response", "fact"),
    [
        (
            reply(403, {"message": 'pods is forbidden: User "a" cannot create resource "pods"'}),
            "cannot create resource .*set jupyter.simulators=true in the chart's values",
        ),
        (reply(403, {"message": "denied the request by a policy"}), r"refused \(denied .* a policy\)$"),
        (raw(b"<html>bad gateway</html>", 502), r"the API server refused \(<html>bad gateway</html>\)$"),
        (hang_up, "the API server does not respond"),
    ],
    ids=["a missing right", "an admission plugin", "a proxy", "no response"],
)
def test_a_refusal_has_the_words_of_the_api_server_and_the_remedy_for_a_right(server, response, fact):
    """A user of a notebook has no access to the API server's log."""
    server.calls = [response]

    with pytest.raises(ConfigurationError, match=f"launcher kubernetes: .*{fact}"):
        NamespaceClient().create(PODS, {})


def test_a_missing_object_is_none_and_every_request_is_for_the_own_namespace(server):
    """The service account of a notebook has rights in its own namespace only."""
    server.calls = [reply(404)]

    assert NamespaceClient().get(PODS, "gone") is None
    assert [asked.path for asked in server.asked] == ["/api/v1/namespaces/lab/pods/gone"]


def test_a_program_without_access_to_a_cluster_is_told_what_to_use(monkeypatch, tmp_path):
    """In a container without a service account, the remedy is another launcher."""
    (tmp_path / "namespace").write_text("lab\n")
    monkeypatch.setattr(kubernetes_api, "_NAMESPACE", tmp_path / "namespace")
    monkeypatch.delenv("KUBERNETES_SERVICE_HOST", raising=False)

    with pytest.raises(ConfigurationError, match=r'no access to a cluster .* or use launcher="process"'):
        NamespaceClient()


def test_a_world_that_no_config_map_holds_is_refused_before_anything_is_created(server, tmp_path):
    """The API server would refuse the ConfigMap after the Job exists."""
    world = tmp_path / "city.wbt"
    world.write_bytes(b"#VRML_SIM R2025a utf8\n".ljust(800_000))

    with pytest.raises(ConfigurationError, match=re.escape("city.wbt: has 800000 bytes, and a pod gets at")):
        start_pod(SETTINGS, SimulatorRequest(world=world))
    assert {asked.method for asked in server.asked} == {"GET"}


def test_a_ros_master_that_no_pod_reaches_is_refused(server, monkeypatch):
    """The simulator would register nowhere, and the user would wait until `start_s` has passed."""
    master = RpcServer(("127.0.0.1", 0), lambda _: lambda _: [1, "", 1])
    master.start()
    monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{master.port}")
    try:
        with pytest.raises(ConfigurationError, match=r"a pod cannot reach the ROS master at http://127\.0"):
            start_pod(SETTINGS, SimulatorRequest(world="arena"))
    finally:
        master.close()
    assert {asked.method for asked in server.asked} == {"GET"}


def test_a_world_file_that_cannot_be_read_is_named(server, monkeypatch, tmp_path):
    """The file may belong to another user of a shared volume."""
    world = tmp_path / "secret.wbt"
    world.touch()

    def refuse(_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_bytes", refuse)  # root, which may run the tests, can read every file

    with pytest.raises(ConfigurationError, match=r"secret\.wbt: cannot be read \(Permission denied\)"):
        start_pod(SETTINGS, SimulatorRequest(world=world))
    assert len(server.asked) == 1
