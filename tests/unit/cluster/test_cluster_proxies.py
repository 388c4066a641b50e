"""The proxy for a server comes from environment variables, which are read by the rules of Go."""

import pytest

from palaestra.cluster import NotConfigured
from palaestra.cluster.proxies import Proxy, connects_directly, proxy_named, proxy_of_environment


# Source: the rules and examples of golang.org/x/net/http/httpproxy.
@pytest.mark.parametrize(
    ("exceptions", "host", "direct"),
    [
        ("", "api.example", False),
        ("*", "api.example", True),
        (" , api.example ,", "api.example", True),
        ("example", "api.example", True),
        ("ample", "api.example", False),
        ("API.Example", "api.example", True),
        (".example", "api.example", True),
        (".example", "example", False),
        ("*.example", "api.example", True),
        ("*.example", "example", False),
        ("api.example:6443", "api.example", True),
        ("api.example:443", "api.example", False),
        (":6443", "api.example", False),
        ("10.0.0.0/8", "10.1.2.3", True),
        ("10.0.0.0/8", "11.1.2.3", False),
        ("10.0.0.0/8", "api.example", False),
        ("10.0.0.0/99", "10.1.2.3", False),
        ("10.1.2.3", "10.1.2.3", True),
        ("2.3", "10.1.2.3", False),
        ("10.1.2.3:6443", "10.1.2.3", True),
        ("10.1.2.3:443", "10.1.2.3", False),
        ("fd00::/8", "fd00::1", True),
        ("fd00::1", "fd00::1", True),
        ("[fd00::1]", "fd00::1", True),
        ("[fd00::1]:6443", "fd00::1", True),
        ("[fd00::1]:443", "fd00::1", False),
        ("10.0.0.0/8", "fd00::1", False),
        ("", "localhost", True),
        ("", "127.0.0.2", True),
        ("", "::1", True),
    ],
)
def test_no_proxy_is_read_as_go_does(exceptions, host, direct):
    """NO_PROXY may list networks, ports and subdomains.

    Even without it, connections to this machine never use a proxy.
    """
    assert connects_directly(host, 6443, exceptions) is direct


@pytest.mark.parametrize(
    ("text", "proxy"),
    [
        ("http://proxy", Proxy(address="http://proxy:80")),
        ("https://proxy", Proxy(address="https://proxy:443")),
        ("proxy:3128", Proxy(address="http://proxy:3128")),
        ("me:p%40w@proxy:3128", Proxy(address="http://proxy:3128", user="me", password="p@w")),
        ("socks5://proxy", Proxy(address="socks5h://proxy:1080")),
        ("socks4a://me@proxy:1", Proxy(address="socks4a://proxy:1", user="me")),
        ("http://[fd00::1]:3128", Proxy(address="http://[fd00::1]:3128")),
    ],
)
def test_a_proxy_is_named_in_every_form_of_curl(text, proxy):
    """A value that works for curl must work here.

    If the port is missing, the default port of the scheme is used.
    """
    assert proxy_named(text, "HTTPS_PROXY") == proxy


@pytest.mark.parametrize(
    "text", ["ftp://me:secret@proxy", "me:secret@", "http://", "http://me:secret@proxy:port"]
)
def test_what_is_no_proxy_is_refused_without_its_password(text):
    """The message names the variable and the remedy. The password must not reach a terminal or a log."""
    with pytest.raises(NotConfigured, match=r"^HTTPS_PROXY: .* is not a proxy; write http://") as refused:
        proxy_named(text, "HTTPS_PROXY")

    assert "secret" not in str(refused.value)


@pytest.mark.parametrize(
    ("environment", "server", "address"),
    [
        ({}, "https://api.example", None),
        ({"HTTPS_PROXY": "one", "https_proxy": "two"}, "https://api.example", "http://one:80"),
        ({"HTTPS_PROXY": "", "https_proxy": "two"}, "https://api.example", "http://two:80"),
        ({"HTTPS_PROXY": "one"}, "http://api.example", None),
        ({"HTTP_PROXY": "one"}, "http://api.example", "http://one:80"),
        ({"HTTPS_PROXY": "one", "no_proxy": "api.example:443"}, "https://api.example", None),
        ({"HTTPS_PROXY": "one", "NO_PROXY": "fd00::/8"}, "https://[fd00::1]:6443", None),
    ],
)
def test_the_variables_are_those_of_go(environment, server, address):
    """`kubectl` is a Go program and must find the same proxy.

    The upper-case variable has priority, an empty variable counts as unset, and ALL_PROXY is ignored.
    """
    found = proxy_of_environment(server, environment | {"ALL_PROXY": "http://never"})

    assert (found.address if found else None) == address
