"""A pod's service account gives the address of the API server, and a token that the kubelet renews."""

import pytest
from urllib3 import ProxyManager

from palaestra.cluster import NotConfigured, Unreachable
from palaestra.cluster.service_account import account
from palaestra.cluster.tokens import FRESH_S
from tests.control_plane.certificates import Authority


@pytest.fixture(scope="module")
def authority(tmp_path_factory):
    """Return the certificate of a certificate authority."""
    return Authority.create(tmp_path_factory.mktemp("authority")).pair.certificate.read_bytes()


@pytest.fixture
def files(tmp_path, monkeypatch, authority):
    """Set the files and the environment of a pod, and return the folder."""
    (tmp_path / "ca.crt").write_bytes(authority)
    (tmp_path / "token").write_text("first\n")
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", "10.96.0.1")
    monkeypatch.setenv("KUBERNETES_SERVICE_PORT", "443")
    for name in ("HTTPS_PROXY", "https_proxy", "NO_PROXY", "no_proxy"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


class Clock:
    """A clock that only tests move."""

    now_s = 100.0

    def __call__(self):
        """Return the current time in seconds."""
        return self.now_s


@pytest.mark.parametrize(
    ("host", "address"), [("10.96.0.1", "https://10.96.0.1:443"), ("fd00::1", "https://[fd00::1]:443")]
)
def test_the_environment_names_the_api_server(files, monkeypatch, host, address):
    """An IPv6 address needs brackets in the URL."""
    monkeypatch.setenv("KUBERNETES_SERVICE_HOST", host)

    assert account(files).host == address


def test_a_token_that_was_replaced_is_sent_within_a_minute(files):
    """The kubelet renews a token after 80% of its lifetime, and the API server refuses an expired one."""
    clock = Clock()
    header = account(files, clock).authorization
    before = header()
    (files / "token").write_text("second")

    at_once = header()
    clock.now_s += FRESH_S

    assert (before, at_once, header()) == ("Bearer first", "Bearer first", "Bearer second")


def test_a_token_that_cannot_be_read_is_no_end(files):
    """Requests fail and are retried until the token is readable again."""
    clock = Clock()
    header = account(files, clock).authorization
    (files / "token").rename(files / "elsewhere")
    with pytest.raises(Unreachable, match="token is missing, empty, unreadable or not ASCII"):
        header()

    (files / "elsewhere").rename(files / "token")

    assert header() == "Bearer first"


@pytest.mark.parametrize("lost", ["ca.crt", "token"])
def test_a_pod_without_an_account_is_refused(files, lost):
    """With `automountServiceAccountToken: false` a pod has the variables but not the files."""
    (files / lost).unlink()

    with pytest.raises(NotConfigured, match=f"{lost} is missing"):
        account(files)


def test_an_authority_that_is_none_is_refused(files):
    """Without this check the operator would end with an error of `ssl`, which does not name the file."""
    (files / "ca.crt").write_text("nothing")

    with pytest.raises(NotConfigured, match="is not a certificate"):
        account(files)


def test_an_authority_that_was_replaced_is_trusted_within_a_minute(files, tmp_path):
    """A cluster may renew its certificate authority while the operator runs."""
    clock = Clock()
    access_of = account(files, clock)
    other = tmp_path / "other"
    other.mkdir()
    (files / "ca.crt").write_bytes(Authority.create(other).pair.certificate.read_bytes())
    tls = access_of.pool.connection_pool_kw["ssl_context"]

    access_of.authorization()
    before = len(tls.get_ca_certs())
    clock.now_s += FRESH_S
    access_of.authorization()

    assert (before, len(tls.get_ca_certs())) == (1, 2)


def test_outside_of_a_pod_there_is_no_account(files, monkeypatch):
    """A laptop may have such files, but without the variables of a pod it has no service account."""
    monkeypatch.delenv("KUBERNETES_SERVICE_HOST")

    with pytest.raises(NotConfigured, match="KUBERNETES_SERVICE_HOST"):
        account(files)


@pytest.mark.parametrize(
    ("proxy", "direct", "proxied"),
    [(None, "", False), ("http://proxy:3128", "", True), ("http://proxy:3128", "10.0.0.0/8", False)],
    ids=["none", "for all", "not for the cluster's network"],
)
def test_a_proxy_of_the_environment_is_used_but_where_it_says_not(files, monkeypatch, proxy, direct, proxied):
    """The operator must use the same proxy as `kubectl`, which accepts networks in NO_PROXY too."""
    if proxy:
        monkeypatch.setenv("HTTPS_PROXY", proxy)
    monkeypatch.setenv("NO_PROXY", direct)

    assert isinstance(account(files).pool, ProxyManager) is proxied
