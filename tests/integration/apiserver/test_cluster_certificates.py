"""The certificate of an API server: our client accepts and rejects the same certificates as kubectl."""

import json
import socket
import ssl
from types import SimpleNamespace

import pytest

from palaestra.cluster import Api, Timeouts, Untrusted, connect, service_account
from palaestra.cluster.transport import Transport
from palaestra.doctor import examine
from tests.control_plane.certificates import Authority
from tests.integration.apiserver.conftest import write_kubeconfig
from tests.integration.apiserver.server import command, reply, serving

# In 2019, EKS created authorities without key identifiers. MicroK8s creates authorities with key identifiers,
# but without a key usage.
KINDS = {"EKS": ("subjectKeyIdentifier=none", "authorityKeyIdentifier=none"), "MicroK8s": ()}
WORKED = b'\x03{"status": "Success"}'


@pytest.fixture(autouse=True)
def strict(monkeypatch):
    """Make every TLS context as strict as in Python 3.13, whatever Python runs the tests."""
    usual = ssl.create_default_context

    def strictly(*arguments, **options):
        context = usual(*arguments, **options)
        context.verify_flags |= ssl.VERIFY_X509_STRICT
        return context

    monkeypatch.setattr(ssl, "create_default_context", strictly)
    return strictly


def shown(pair):
    """Return the TLS context with which a server presents its certificate."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(pair.certificate, pair.key)
    return context


@pytest.fixture(scope="module")
def authorities(tmp_path_factory):
    """Return an authority of each kind in `KINDS`."""
    made = {}
    for name, extensions in KINDS.items():
        made[name] = Authority.create(tmp_path_factory.mktemp(name), *extensions)
    return made


@pytest.fixture(scope="module", params=KINDS)
def lenient(request, authorities):
    """Yield a server whose authority lacks extensions that Python 3.13 requires."""
    authority = authorities[request.param]
    pair = (
        authority.bare_server(["127.0.0.1"], 1) if KINDS[request.param] else authority.server(["127.0.0.1"])
    )
    with serving(shown(pair)) as (address, script):
        yield SimpleNamespace(address=address, script=script, authority=authority.pair.certificate)


def kubeconfig_of(path, address, **cluster):
    """Write a kubeconfig for a server, with these additional fields of the cluster."""
    file = write_kubeconfig(path / "kubeconfig", address, {"token": "my-token"})
    content = json.loads((path / "kubeconfig").read_text())
    content["clusters"][0]["cluster"] |= cluster
    (path / "kubeconfig").write_text(json.dumps(content))
    return file


def test_python_of_the_images_would_refuse_these_authorities(lenient, strict):
    """If the images' Python accepted these authorities by default, the other tests would prove nothing."""
    context = strict(cafile=lenient.authority)
    assert context.verify_flags & ssl.VERIFY_X509_STRICT
    host, port = lenient.address.removeprefix("https://").split(":")

    with (
        pytest.raises(ssl.SSLCertVerificationError),
        socket.create_connection((host, int(port)), timeout=10) as connection,
    ):
        context.wrap_socket(connection, server_hostname=host)


def test_a_kubeconfig_reaches_a_server_whose_authority_lacks_extensions(lenient, tmp_path):
    """A user whose kubectl accepts these authorities expects that `palaestra` does so too."""
    lenient.script.calls = [reply(obj={"gitVersion": "v1.36.4"}), command(b"\x01hello", WORKED)]
    file = kubeconfig_of(tmp_path, lenient.address, **{"certificate-authority": str(lenient.authority)})

    api = connect(file)

    assert api.version() == "v1.36.4"
    assert b"".join(api.execute("robots", "pod", "trainer", ["ls"], within_s=10)) == b"hello"
    api.close()


def test_a_pod_reaches_a_server_whose_authority_lacks_extensions(lenient, tmp_path, monkeypatch):
    """If the client refused such an authority, the operator would never become ready in the cluster."""
    lenient.script.calls = [reply(obj={"gitVersion": "v1.36.4"})]
    (tmp_path / "ca.crt").write_bytes(lenient.authority.read_bytes())
    (tmp_path / "token").write_text("of-the-pod")
    host, port = lenient.address.removeprefix("https://").split(":")
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", host)
    monkeypatch.setenv("KUBERNETES_SERVICE_PORT", port)

    api = Api(Transport(service_account.account(tmp_path), Timeouts()))

    assert api.version() == "v1.36.4"
    api.close()


@pytest.fixture(scope="module")
def wrong(authorities, tmp_path_factory):
    """Yield servers with one error each in their certificates, with their addresses and the authority."""
    good = authorities["MicroK8s"]
    other = Authority.create(tmp_path_factory.mktemp("other"))
    with (
        serving(shown(good.server(["127.0.0.9"]))) as (misnamed, first),
        serving(shown(other.server(["127.0.0.1"]))) as (foreign, second),
        serving(shown(good.bare_server(["127.0.0.1"], -1))) as (expired, third),
    ):
        for script in (first, second, third):
            script.calls = [reply(obj={"gitVersion": "v1.36.4"})]
        ca = str(good.pair.certificate)
        yield {"name": (misnamed, ca), "authority": (foreign, ca), "dates": (expired, ca)}


@pytest.mark.parametrize(
    ("way", "fact", "remedy"),
    [
        ("name", "is for another name", "tls-server-name"),
        ("authority", "is not from the trusted authority", "certificate authority"),
        ("dates", "has expired", "clock"),
    ],
)
def test_what_is_wrong_with_a_certificate_is_named(wrong, tmp_path, way, fact, remedy):
    """A user must learn the cause from any command, and the client must not send credentials."""
    address, authority = wrong[way]
    api = connect(kubeconfig_of(tmp_path, address, **{"certificate-authority": authority}))

    with pytest.raises(Untrusted, match=f"{address}: the server's certificate {fact}.*{remedy}"):
        api.version()
    with pytest.raises(Untrusted, match=fact):
        list(api.execute("robots", "pod", "trainer", ["ls"], within_s=10))
    api.close()


def test_the_doctor_gives_the_remedy_of_the_certificate(wrong, tmp_path):
    """The usual remedy, to check the connection, would mislead a user whose connection works."""
    address, authority = wrong["name"]
    api = connect(kubeconfig_of(tmp_path, address, **{"certificate-authority": authority}))

    finding = next(iter(examine(SimpleNamespace(api=api, namespace="robots"))))

    assert "is for another name" in finding.fact
    assert "tls-server-name" in finding.remedy
    api.close()


def test_a_server_may_have_another_name_in_its_certificate(wrong, tmp_path):
    """The error message names this setting, so the setting must work."""
    address, authority = wrong["name"]
    settings = {"certificate-authority": authority, "tls-server-name": "localhost"}
    api = connect(kubeconfig_of(tmp_path, address, **settings))

    assert api.version() == "v1.36.4"
    api.close()


def test_an_unverified_server_is_warned_of_once(wrong, tmp_path, caplog):
    """The user has set `insecure-skip-tls-verify`, and needs only one warning about it."""
    address, _ = wrong["dates"]
    file = kubeconfig_of(tmp_path, address, **{"insecure-skip-tls-verify": True})
    api = connect(file)

    assert api.version() == api.version() == "v1.36.4"
    api.close()
    (warned,) = (record.getMessage() for record in caplog.records)
    assert warned.startswith(
        f"{file}: insecure-skip-tls-verify is set, so the certificate of {address} is not"
    )
