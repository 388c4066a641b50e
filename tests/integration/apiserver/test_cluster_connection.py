"""The client reads server and user from a kubeconfig, a plugin, or a pod's service account."""

import base64
import json
import stat
from pathlib import Path

import pytest

from palaestra.cluster import (
    Api,
    ApiError,
    Forbidden,
    NotConfigured,
    Timeouts,
    Unreachable,
    connect,
    connection,
    own_namespace,
    service_account,
)
from palaestra.cluster.resources import PODS
from palaestra.cluster.transport import Transport
from tests.control_plane.certificates import Authority
from tests.integration.apiserver.conftest import write_kubeconfig
from tests.integration.apiserver.server import reply


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch, tmp_path):
    """Hide the kubeconfig of the person who runs the tests."""
    monkeypatch.delenv("KUBECONFIG", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))


def who_asks(rude, api):
    """Return the credentials that the server received."""
    rude.script.calls = [reply(obj={"gitVersion": "v1.36.4"})]
    assert api.version() == "v1.36.4"
    api.close()
    return rude.script.asked[-1].headers.get("Authorization")


def test_the_current_context_is_used_where_none_is_named(rude):
    """The client must connect to the same cluster as kubectl."""
    assert who_asks(rude, connect(rude.kubeconfig)) == "Bearer my-token"


def test_a_context_may_be_named(rude):
    """A user may have one file for several clusters."""
    assert who_asks(rude, connect(rude.kubeconfig, "other")) == "Bearer other-token"


def test_the_environment_names_a_kubeconfig(rude, monkeypatch):
    """A user sets KUBECONFIG for kubectl, and expects the same from `palaestra`."""
    monkeypatch.setenv("KUBECONFIG", rude.kubeconfig)

    assert who_asks(rude, connect()) == "Bearer my-token"


def test_a_plugin_is_asked_for_a_token(rude, tmp_path):
    """Clouds issue short-lived credentials by such plugins."""
    plugin = tmp_path / "plugin"
    answer = {
        "apiVersion": "client.authentication.k8s.io/v1",
        "kind": "ExecCredential",
        "status": {"token": "of-the-plugin"},
    }
    plugin.write_text(f"#!/bin/sh\necho '{json.dumps(answer)}'\n")
    plugin.chmod(plugin.stat().st_mode | stat.S_IXUSR)
    user = {"exec": {"apiVersion": answer["apiVersion"], "command": str(plugin), "interactiveMode": "Never"}}

    api = connect(write_kubeconfig(tmp_path / "with-plugin", rude.address, user))

    assert who_asks(rude, api) == "Bearer of-the-plugin"


def test_certificates_may_stand_in_the_kubeconfig_itself(control_plane, tmp_path):
    """Most clouds, and kind, write kubeconfigs that contain the certificates."""
    content = json.loads(control_plane.kubeconfig.read_text())
    for part in (content["clusters"][0]["cluster"], content["users"][0]["user"]):
        for field in [field for field in part if field != "server"]:
            part[f"{field}-data"] = base64.b64encode(Path(part.pop(field)).read_bytes()).decode()
    kubeconfig = tmp_path / "whole"
    kubeconfig.write_text(json.dumps(content))

    api = connect(str(kubeconfig))
    assert api.list(PODS, "default") == []
    api.close()


def test_a_server_that_another_authority_vouches_for_is_not_talked_to(control_plane, tmp_path):
    """A server with a certificate from another authority must not receive credentials."""
    content = json.loads(control_plane.kubeconfig.read_text())
    other = tmp_path / "other"
    other.mkdir()
    authority = str(Authority.create(other).pair.certificate)
    content["clusters"][0]["cluster"]["certificate-authority"] = authority
    kubeconfig = tmp_path / "wrong"
    kubeconfig.write_text(json.dumps(content))

    with pytest.raises(Unreachable, match="certificate"):
        connect(str(kubeconfig)).version()


@pytest.fixture
def in_a_pod(control_plane, tmp_path, monkeypatch):
    """Set the environment and write the files of a pod, and return the folder of the service account."""
    authority = control_plane.authority.pair.certificate
    (tmp_path / "ca.crt").write_bytes(authority.read_bytes())
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", "127.0.0.1")
    monkeypatch.setenv("KUBERNETES_SERVICE_PORT", str(control_plane.port))
    monkeypatch.setattr(service_account, "FILES", tmp_path)
    return tmp_path


def token_of(control_plane, *options):
    """Return a token of the default account."""
    there = ("serviceaccount/default", "--namespace=default", "--timeout=30s")
    assert control_plane.kubectl("wait", "--for=create", *there).returncode == 0
    return control_plane.kubectl("create", "token", "default", *options).stdout.strip()


def test_a_pod_is_its_service_account_and_reads_its_token_anew(control_plane, in_a_pod):
    """The kubelet replaces a token before it expires, while the operator runs."""
    now_s = [0.0]
    (in_a_pod / "token").write_text("expired")
    api = Api(Transport(service_account.account(clock=lambda: now_s[0]), Timeouts()))
    with pytest.raises(ApiError, match="Unauthorized"):
        api.version()

    (in_a_pod / "token").write_text(token_of(control_plane))
    now_s[0] = 60.0

    with pytest.raises(Forbidden, match='"system:serviceaccount:default:default" cannot list'):
        api.list(PODS, "default")
    api.close()


def test_in_a_pod_nothing_has_to_be_named(control_plane, in_a_pod):
    """A user in a pod needs no kubeconfig and no option."""
    (in_a_pod / "token").write_text(token_of(control_plane))

    api = connect()

    assert api.version().startswith("v1.")
    api.close()


@pytest.mark.parametrize(
    "content",
    ["", "[]", "{}", "not: [yaml", '{"current-context": "x", "contexts": []}', "contexts: 7"],
)
def test_a_kubeconfig_that_cannot_be_used_is_named_with_a_remedy(tmp_path, content):
    """From the message, a user learns which file is wrong and how to name another one."""
    path = tmp_path / "wrong"
    path.write_text(content)

    with pytest.raises(NotConfigured, match=f"{path}: .*KUBECONFIG"):
        connect(str(path))


def test_a_missing_kubeconfig_is_named(tmp_path):
    """If the file that a user named is missing, the client must not use another identity."""
    with pytest.raises(NotConfigured, match="missing"):
        connect(str(tmp_path / "missing"))


def test_nowhere_to_connect_to_is_said_with_a_remedy():
    """A new user runs a command on a laptop without a cluster, and must learn the option."""
    with pytest.raises(NotConfigured, match="--kubeconfig"):
        connect()


@pytest.mark.parametrize(
    ("content", "namespace"),
    [(b"robots\n", "robots"), (b"", "usual"), (b"\xff", "usual"), (None, "usual")],
    ids=["a pod's", "empty", "damaged", "no pod"],
)
def test_the_own_namespace_is_the_pods_or_the_usual_one(monkeypatch, tmp_path, content, namespace):
    """A pod may mount only parts of its service account, so the file may be missing or empty."""
    file = tmp_path / "namespace"
    if content is not None:
        file.write_bytes(content)
    monkeypatch.setattr(connection, "OWN_NAMESPACE", file)

    assert own_namespace("usual") == namespace
