"""The fields of a kubeconfig that need no request to the server."""

import base64
import json
import re
import time

import pytest
import yaml

from palaestra.cluster import NotConfigured, Unreachable
from palaestra.cluster.kubeconfig import access, namespace

SERVER = "https://127.0.0.1:6443"


@pytest.fixture
def written(tmp_path):
    """Return a function that writes a kubeconfig with one context; it returns the path."""

    def write(user=None, context=None, **cluster):
        content = {
            "clusters": [{"name": "here", "cluster": {"server": SERVER} | cluster}],
            "users": [{"name": "me", "user": user or {}}],
            "contexts": [{"name": "usual", "context": {"cluster": "here", "user": "me"} | (context or {})}],
            "current-context": "usual",
        }
        path = tmp_path / "kubeconfig"
        path.write_text(yaml.safe_dump(content))
        return str(path)

    return write


def token(expires_s):
    """Return an ID token that expires at a time; only its fields matter, since the server checks it."""
    parts = ({"alg": "none"}, {"exp": int(expires_s)}, {})
    return ".".join(
        base64.urlsafe_b64encode(json.dumps(part).encode()).decode().rstrip("=") for part in parts
    )


def test_the_namespace_is_that_of_the_chosen_context(written):
    """`palaestra jobs` shows the jobs where `kubectl get` would."""
    assert namespace(written(context={"namespace": "lab"}), None) == "lab"
    assert namespace(written(context={"namespace": "lab"}), "usual") == "lab"
    assert namespace(written(), None) is None


def test_a_context_that_is_missing_is_named_with_the_command_that_lists_contexts(written):
    """A person who mistyped the name finds the right name with this command."""
    with pytest.raises(
        NotConfigured, match=r"--context: .* has no context 'usaul'; `kubectl config get-cont"
    ):
        namespace(written(), "usaul")


def test_a_kubeconfig_that_is_not_yaml_is_an_error_of_one_line(tmp_path):
    """The YAML parser's own message has several lines, of which a log would show the first."""
    path = tmp_path / "kubeconfig"
    path.write_text("contexts: [\n- :\n")

    with pytest.raises(NotConfigured, match=re.escape(str(path))) as caught:
        namespace(str(path), None)
    assert "\n" not in str(caught.value)


def test_a_cluster_without_fields_is_refused_by_its_name(tmp_path, written):
    """A person who edits the file by hand may leave the address out."""
    path = tmp_path / "kubeconfig"
    path.write_text(
        written() and path.read_text().replace(f"cluster:\n    server: {SERVER}", "cluster: here:6443")
    )

    with pytest.raises(NotConfigured, match="the cluster of the context is not a mapping of fields"):
        access(str(path), None)


def test_the_token_of_an_oidc_provider_is_used_while_it_is_valid(written):
    """Some universities still give out kubeconfigs with this provider. A valid token needs no request."""
    valid = token(time.time() + 3600)
    user = {"auth-provider": {"name": "oidc", "config": {"id-token": valid, "idp-issuer-url": SERVER}}}

    assert access(written(user), None).authorization() == f"Bearer {valid}"


def test_an_identity_provider_that_does_not_respond_is_an_error_that_a_retry_may_solve(written, monkeypatch):
    """The provider may respond later. Until then, a person needs the name of the field, not a traceback."""
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    config = {"id-token": token(1), "refresh-token": "r", "idp-issuer-url": "http://127.0.0.1:1"}
    user = {"auth-provider": {"name": "oidc", "config": config}}

    with pytest.raises(Unreachable, match=r"auth-provider returned no token .*127\.0\.0\.1") as caught:
        access(written(user), None)
    assert caught.value.retryable


def test_a_plugin_gets_the_extension_of_its_cluster(written, tmp_path):
    """A plugin with `provideClusterInfo` finds its own settings there, such as an audience."""
    status = {
        "kind": "ExecCredential",
        "apiVersion": "client.authentication.k8s.io/v1",
        "status": {"token": "t"},
    }
    script = tmp_path / "plugin"
    script.write_text(
        f"""#!/bin/sh\necho "$KUBERNETES_EXEC_INFO" > {tmp_path}/info\necho '{json.dumps(status)}'\n"""
    )
    script.chmod(0o755)
    plugin = {
        "apiVersion": status["apiVersion"],
        "command": str(script),
        "interactiveMode": "Never",
        "provideClusterInfo": True,
    }
    extensions = [
        {"name": "other", "extension": {"audience": "wrong"}},
        {"name": "client.authentication.k8s.io/exec", "extension": {"audience": "here"}},
    ]

    assert access(written({"exec": plugin}, extensions=extensions), None).authorization() == "Bearer t"

    cluster = json.loads((tmp_path / "info").read_text())["spec"]["cluster"]
    assert (cluster["server"], cluster["config"]) == (SERVER, {"audience": "here"})
