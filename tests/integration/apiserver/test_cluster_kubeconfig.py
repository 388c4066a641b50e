"""The client reads a kubeconfig as kubectl does: the user, and the proxy and address of the server."""

import io
import json
import ssl
import stat
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from palaestra.cluster import Api, NotConfigured, Timeouts, Unreachable, connect, service_account
from palaestra.cluster.resources import PODS
from palaestra.cluster.transport import Transport
from tests.control_plane.certificates import Authority
from tests.integration.apiserver.conftest import write_kubeconfig
from tests.integration.apiserver.relay import relaying
from tests.integration.apiserver.server import command, reply, serving, stream

WORKED = b'\x03{"status": "Success"}'
V1 = "client.authentication.k8s.io/v1"
HASTE = Timeouts(connect_s=2, call_s=2)
PROXIES = ("HTTPS_PROXY", "https_proxy", "HTTP_PROXY", "http_proxy", "NO_PROXY", "no_proxy", "ALL_PROXY")


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch, tmp_path):
    """Hide the kubeconfig and the proxies of the person who runs the tests."""
    monkeypatch.setenv("HOME", str(tmp_path))
    for name in ("KUBECONFIG", *PROXIES):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture(scope="module")
def authority(tmp_path_factory):
    """Return the authority of the servers and proxies."""
    return Authority.create(tmp_path_factory.mktemp("authority"))


@pytest.fixture(scope="module")
def shown(authority):
    """Return the TLS context with which servers and proxies present their certificate."""
    pair = authority.server(["127.0.0.1", "::1", "10.96.0.1"])
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(pair.certificate, pair.key)
    return context


@pytest.fixture
def secure(shown, authority):
    """Yield a TLS server that responds to a request, a watch and a command."""
    with serving(shown) as (address, script):
        prepare(script)
        port = int(address.rpartition(":")[2])
        ca = str(authority.pair.certificate)
        yield SimpleNamespace(address=address, script=script, port=port, ca=ca)


def prepare(script):
    """Prepare the responses to a request, a command and any number of watches."""
    script.calls = [reply(obj={"gitVersion": "v1.36.4"}), command(b"\x01hello", WORKED)]
    script.watches = [stream()]


def written(path, address, user, **cluster):
    """Write a kubeconfig with a user, and with these additional fields of the cluster."""
    file = write_kubeconfig(path / "kubeconfig", address, user)
    content = json.loads((path / "kubeconfig").read_text())
    content["clusters"][0]["cluster"] |= cluster
    (path / "kubeconfig").write_text(json.dumps(content))
    return file


def ask_all(api):
    """Send a request, a watch and a command."""
    assert api.version() == "v1.36.4"
    assert list(api.watch(PODS, version="1", seconds=1)) == []
    assert b"".join(api.execute("robots", "pod", "trainer", ["ls"], within_s=10)) == b"hello"
    api.close()


def authorizations(script):
    """Return the credentials of each request."""
    return [asked.headers.get("Authorization") for asked in script.asked]


def test_requests_act_for_the_user_that_the_kubeconfig_names(secure, tmp_path):
    """Without impersonation in every kind of request, a student would act as the administrator."""
    user = {
        "token": "of-the-administrator",
        "as": "Jürgen",
        "as-uid": "7",
        "as-groups": ["students", "system:serviceaccounts"],
        "as-user-extra": {"example.org/scope %": ["a", "b"]},
    }
    ask_all(connect(written(tmp_path, secure.address, user, **{"certificate-authority": secure.ca})))

    # The header contains bytes in UTF-8, which http.server reads as Latin-1.
    whom = [("Impersonate-User", "Jürgen".encode().decode("latin-1")), ("Impersonate-Uid", "7")]
    whom += [("Impersonate-Group", "students"), ("Impersonate-Group", "system:serviceaccounts")]
    whom += [("Impersonate-Extra-example.org%2Fscope%20%25", value) for value in "ab"]
    sent = [
        [line for line in asked.lines if line[0].startswith("Impersonate")] for asked in secure.script.asked
    ]
    assert sent == [whom] * 3


@pytest.mark.parametrize(
    ("user", "fact"),
    [
        ({"as-groups": ["students"]}, "as is missing"),
        ({"as-uid": "7"}, "as is missing"),
        ({"as": "a", "as-groups": "students"}, "as-groups: 'students' is not a list"),
        ({"as": "a", "as-user-extra": {"k": "v"}}, "as-user-extra: .* is not a mapping of lists"),
        ({"as": "a\nAuthorization: x"}, "as: .* is not text of printable characters"),
        ({"as": "a", "as-uid": 7}, "as-uid: 7 is not text of printable characters"),
        ({"token": "a", "username": "b"}, "both token and username"),
        ({"token": "a\nb"}, "token is empty, or has other characters than printable ASCII"),
        ({"tokenFile": "/nowhere"}, "tokenFile: /nowhere is missing, empty, unreadable or not ASCII"),
        ({"exec": "plugin"}, "exec: 'plugin' is not a mapping"),
        ({"exec": {"apiVersion": V1}}, "exec: command is missing"),
        ({"exec": {"apiVersion": "v0", "command": "x"}}, "exec: apiVersion 'v0' is not known"),
        ({"exec": {"apiVersion": V1, "command": "x"}}, "exec: interactiveMode '' is not known"),
        (
            {"exec": {"apiVersion": V1, "command": "x", "interactiveMode": "Never", "env": [1]}},
            "env is not a list",
        ),
        ({"auth-provider": {"name": "gcp"}}, "auth-provider: 'gcp' is no longer supported"),
        ({"client-certificate-data": "AAAA"}, "client-key is missing"),
        ({"client-certificate-data": "?", "client-key-data": "?"}, "client-certificate-data is not base64"),
        ({"client-certificate-data": "AAAA", "client-key-data": "AAAA"}, "cannot be used together"),
        ({"client-certificate": "nowhere", "client-key": "nowhere"}, "nowhere"),
    ],
)
def test_a_wrong_user_is_refused_in_one_sentence(tmp_path, user, fact):
    """The client must report file and field before it sends a request."""
    file = written(tmp_path, "https://127.0.0.1:1", user)

    with pytest.raises(NotConfigured, match=f"^{file}: .*{fact}") as refused:
        connect(file)

    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("cluster", "fact"),
    [
        ({"server": ""}, "server: '' is not an address"),
        ({"server": "ftp://host"}, "server: 'ftp://host' is not an address"),
        ({"proxy-url": "ftp://host"}, "proxy-url: ftp://host is not a proxy"),
        ({"proxy-url": "http://me:secret@"}, r"proxy-url: http://\*\*\*@ is not a proxy"),
        ({"certificate-authority-data": "AAAA"}, "certificate-authority is not a certificate in PEM"),
        ({"certificate-authority-data": "AAAA", "insecure-skip-tls-verify": True}, "exclude each other"),
    ],
)
def test_a_wrong_cluster_is_refused_in_one_sentence(tmp_path, cluster, fact):
    """The client must report file and field before it sends a request, and must not print a password."""
    file = written(tmp_path, "https://127.0.0.1:1", {"token": "x"}, **cluster)

    with pytest.raises(NotConfigured, match=f"^{file}: .*{fact}") as refused:
        connect(file)

    assert "secret" not in str(refused.value)


def test_a_tokens_file_may_end_with_a_newline(secure, tmp_path):
    """`echo` adds a newline, which kubectl removes. The path of the file is relative to the kubeconfig."""
    (tmp_path / "token").write_text("in-a-file\n")
    user = {"tokenFile": "token", "token": "older"}

    ask_all(connect(written(tmp_path, secure.address, user, **{"certificate-authority": secure.ca})))

    assert authorizations(secure.script) == ["Bearer in-a-file"] * 3


def test_a_user_may_have_a_password(secure, tmp_path):
    """API servers no longer accept passwords, but a proxy in front of an API server may accept them."""
    user = {"username": "me", "password": "p:w"}

    ask_all(connect(written(tmp_path, secure.address, user, **{"certificate-authority": secure.ca})))

    assert authorizations(secure.script) == ["Basic bWU6cDp3"] * 3


def plugin_of(path, script, **fields):
    """Return a user whose credential plugin is a shell script."""
    plugin = path / "plugin"
    plugin.write_text(f"#!/bin/sh\n{script}\n")
    plugin.chmod(plugin.stat().st_mode | stat.S_IXUSR)
    entry = {"apiVersion": V1, "command": "./plugin", "interactiveMode": "Never"}
    return {"exec": entry | fields}


def given(**status):
    """Return the text that a plugin prints."""
    return json.dumps({"apiVersion": V1, "kind": "ExecCredential", "status": status})


def test_a_plugin_is_run_where_the_kubeconfig_lies_and_again_when_its_token_has_expired(secure, tmp_path):
    """A plugin's path is relative to the kubeconfig, and the plugin may request the cluster's data."""
    count = f'echo "$KUBERNETES_EXEC_INFO $REGION" >> {tmp_path}/runs'
    old = given(token="mine", expirationTimestamp="2020-01-01T00:00:00Z")
    variables = [{"name": "REGION", "value": "eu"}]
    user = plugin_of(tmp_path, f"{count}; echo '{old}'", env=variables, provideClusterInfo=True)

    ask_all(connect(written(tmp_path, secure.address, user, **{"certificate-authority": secure.ca})))

    assert authorizations(secure.script) == ["Bearer mine"] * 3
    runs = (tmp_path / "runs").read_text().splitlines()
    assert len(runs) == 3
    assert f'"server": "{secure.address}"' in runs[0]
    assert runs[0].endswith(" eu")


def test_a_plugin_may_give_a_certificate(authority, tmp_path):
    """The login programs of some companies issue certificates. The server of this test requires one."""
    server, client = authority.server(["127.0.0.1"]), authority.client("me", "", tmp_path)
    asking = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    asking.load_cert_chain(server.certificate, server.key)
    asking.load_verify_locations(authority.pair.certificate)
    asking.verify_mode = ssl.CERT_REQUIRED
    status = given(clientCertificateData=client.certificate.read_text(), clientKeyData=client.key.read_text())
    (tmp_path / "answer").write_text(status)
    user = plugin_of(tmp_path, f"cat {tmp_path}/answer")

    with serving(asking) as (address, script):
        prepare(script)
        ca = str(authority.pair.certificate)
        ask_all(connect(written(tmp_path, address, user, **{"certificate-authority": ca})))

        assert authorizations(script) == [None] * 3


@pytest.mark.parametrize(
    ("script", "fields", "fact"),
    [
        ("echo log in first >&2; exit 3", {}, "failed with exit code 3: log in first"),
        ("echo nonsense", {}, "returned output that is not JSON"),
        ("echo 7", {}, "returned output that is not an ExecCredential"),
        (f"echo '{given()}'", {}, "returned neither a token nor a certificate"),
        (f"echo '{given(clientKeyData='k')}'", {}, "returned neither"),
        (f"echo '{given(clientCertificateData='c')}'", {}, "returned only one of certificate and key"),
        (f"echo '{given(clientCertificateData='c', clientKeyData='k')}'", {}, "cannot be used together"),
        (f"echo '{given(token='t', expirationTimestamp='soon')}'", {}, "is not a time: 'soon'"),
        (f"echo '{given(token='t').replace('/v1', '/v1beta1')}'", {}, "returned apiVersion"),
        (
            "",
            {"command": "no-such-plugin", "installHint": "Get it\nat home"},
            "not installed; Get it at home",
        ),
        ("", {"interactiveMode": "Always"}, "needs a terminal"),
    ],
)
def test_a_plugin_that_gives_nothing_is_named_in_one_sentence(
    secure, tmp_path, monkeypatch, script, fields, fact
):
    """A request without credentials would fail with a misleading error about permissions."""
    monkeypatch.setattr(sys, "stdin", io.StringIO())
    user = plugin_of(tmp_path, script, **fields)
    api = connect(written(tmp_path, secure.address, user, **{"certificate-authority": secure.ca}))

    with pytest.raises(Unreachable, match=f"^the credential plugin.*{fact}") as failed:
        api.version()

    assert "\n" not in str(failed.value)
    assert secure.script.asked == []
    api.close()


@pytest.mark.parametrize(
    ("form", "target", "user"),
    [
        ("http://{}", "127.0.0.1", ""),
        ("http://me:p%40w@{}", "127.0.0.1", "me:p@w"),
        ("{}", "127.0.0.1", ""),
        ("me:pw@{}", "127.0.0.1", "me:pw"),
        ("https://me:pw@{}", "127.0.0.1", "me:pw"),
        ("socks5://{}", "localhost", ""),
        ("socks5h://me:pw@{}", "localhost", "me:pw"),
    ],
)
def test_the_proxy_of_a_cluster_is_used_in_every_form(secure, shown, tmp_path, form, target, user):
    """Requests, watches and commands all use the cluster's proxy.

    A SOCKS proxy resolves the server's name, because kubectl leaves that to the proxy.
    """
    tls = shown if form.startswith("https") else None
    server = f"https://{target}:{secure.port}"
    with relaying(secure.port, tls) as (address, notes):
        settings = {"certificate-authority": secure.ca, "proxy-url": form.format(address)}

        ask_all(connect(written(tmp_path, server, {"token": "x"}, **settings)))

        assert set(notes.targets) == {f"{target}:{secure.port}"}
        assert set(notes.users) == {user}
        assert len(notes.targets) >= 2
    assert authorizations(secure.script) == ["Bearer x"] * 3


@pytest.mark.parametrize("scheme", ["http", "https", "socks5"])
def test_a_proxy_that_is_not_there_is_named(tmp_path, scheme):
    """The errors of requests and commands contain the proxy's address without the password."""
    proxy = f"{scheme}://me:secret@127.0.0.1:1"
    file = written(tmp_path, "https://10.99.0.1:6443", {"token": "x"}, **{"proxy-url": proxy})
    api = connect(file, limits=HASTE)

    for ask in (api.version, lambda: list(api.execute("robots", "pod", "trainer", ["ls"], within_s=10))):
        with pytest.raises(Unreachable, match=r"by way of the proxy \w+://127.0.0.1:1: no answer") as failed:
            ask()
        assert "secret" not in str(failed.value)
    api.close()


def test_a_proxy_that_refuses_is_named(secure, tmp_path):
    """A company's proxy may require a user, so the error must name the proxy and the code 407."""
    with relaying(secure.port) as (address, notes):
        notes.refuses = True
        settings = {"certificate-authority": secure.ca, "proxy-url": f"http://{address}"}
        api = connect(written(tmp_path, secure.address, {"token": "x"}, **settings))

        for ask in (api.version, lambda: list(api.execute("robots", "pod", "trainer", ["ls"], within_s=10))):
            with pytest.raises(Unreachable, match=f"by way of the proxy http://{address}: .*407"):
                ask()
        api.close()


@pytest.mark.parametrize("scheme", ["http", "socks5"])
def test_the_proxy_of_the_environment_is_used(secure, tmp_path, monkeypatch, scheme):
    """A user in a company sets HTTPS_PROXY, and the client must reach a cluster outside of the company."""
    with relaying(secure.port) as (address, notes):
        monkeypatch.setenv("HTTPS_PROXY", f"{scheme}://{address}")
        settings = {"certificate-authority": secure.ca, "tls-server-name": "localhost"}
        api = connect(written(tmp_path, "https://api.robots.example:6443", {"token": "x"}, **settings))

        ask_all(api)

        assert set(notes.targets) == {"api.robots.example:6443"}


def test_a_pod_uses_the_proxy_of_the_environment(secure, tmp_path, monkeypatch):
    """In some clusters, pods reach the API server only through a proxy."""
    (tmp_path / "ca.crt").write_bytes(Path(secure.ca).read_bytes())
    (tmp_path / "token").write_text("of-the-pod\n")
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", "10.96.0.1")
    monkeypatch.setenv("KUBERNETES_SERVICE_PORT", "443")
    with relaying(secure.port) as (address, notes):
        monkeypatch.setenv("https_proxy", f"me:pw@{address}")

        ask_all(Api(Transport(service_account.account(tmp_path), Timeouts())))

        assert (set(notes.targets), set(notes.users)) == ({"10.96.0.1:443"}, {"me:pw"})


def test_a_proxy_of_the_environment_is_not_asked_for_this_machine(secure, tmp_path, monkeypatch):
    """For loopback addresses, which local test clusters have, kubectl never uses a proxy."""
    monkeypatch.setenv("HTTPS_PROXY", "http://127.0.0.1:1")

    ask_all(
        connect(written(tmp_path, secure.address, {"token": "x"}, **{"certificate-authority": secure.ca}))
    )


def test_a_server_may_have_an_address_of_ipv6(shown, authority, tmp_path):
    """Brackets, ports and proxies need special handling for an IPv6 address."""
    ca = {"certificate-authority": str(authority.pair.certificate)}
    with serving(shown, "::1") as (address, script):
        prepare(script)
        ask_all(connect(written(tmp_path, address, {"token": "x"}, **ca)))

    with serving(shown) as (address, script), relaying(int(address.rpartition(":")[2])) as (proxy, notes):
        prepare(script)
        for scheme in ("http", "socks5"):
            prepare(script)
            settings = ca | {"proxy-url": f"{scheme}://{proxy}"}
            ask_all(connect(written(tmp_path, "https://[::1]:6443", {"token": "x"}, **settings)))
        assert set(notes.targets) == {"[::1]:6443", "::1:6443"}


def test_a_server_without_a_scheme_is_https_where_there_are_settings_for_it(secure, tmp_path):
    """Like kubectl, the client must complete such an address with https."""
    server = secure.address.removeprefix("https://")

    ask_all(connect(written(tmp_path, server, {"token": "x"}, **{"certificate-authority": secure.ca})))


def test_the_first_file_decides_the_current_context(secure, tmp_path):
    """KUBECONFIG may name several files. As in kubectl, the first file that sets a value applies."""
    first = tmp_path / "first"
    first.write_text(json.dumps({"current-context": "other"}))
    second = written(tmp_path, secure.address, {"token": "x"}, **{"certificate-authority": secure.ca})

    ask_all(connect(f"{first}:{second}"))

    assert authorizations(secure.script) == ["Bearer other-token"] * 3
