"""The proxy of a connection, from environment variables and a kubeconfig, by the rules of kubectl.

Source of the rules: golang.org/x/net/http/httpproxy, with which kubectl reads the environment.
"""

import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass

from urllib3.exceptions import LocationParseError
from urllib3.util import Url, parse_url

from palaestra.cluster.errors import NotConfigured
from palaestra_protocol.masking import masked

PORTS = {"http": 80, "https": 443, "socks4": 1080, "socks4a": 1080, "socks5": 1080, "socks5h": 1080}
SOCKS = "socks"
REMEDY = "write http://HOST:PORT, https://HOST:PORT or socks5://HOST:PORT"


@dataclass(frozen=True, slots=True, kw_only=True)
class Proxy:
    """A proxy for all connections to one server.

    Attributes:
        address: `http://proxy:3128`, without credentials.
        user: the user name for the proxy, or None.
        password: the password of that user.
    """

    address: str
    user: str | None = None
    password: str | None = None

    @property
    def socks(self) -> bool:
        """Whether the proxy uses SOCKS; other proxies use CONNECT."""
        return self.address.startswith(SOCKS)


def proxy_named(text: str, where: str) -> Proxy:
    """Return the proxy whose address is `text`; without a scheme it is an HTTP proxy, as in curl.

    A SOCKS5 proxy also resolves host names, as in kubectl.

    Raises:
        NotConfigured: the text is not an address, or the scheme is unknown; the message begins with `where`.
    """
    text = text if "://" in text else f"http://{text}"
    url = _parsed(text)
    if url is None or not url.host or url.scheme not in PORTS:
        raise NotConfigured(f"{where}: {masked(text)} is not a proxy; {REMEDY}")
    scheme = "socks5h" if url.scheme == "socks5" else url.scheme
    user, password = url.auth_decoded
    address = f"{scheme}://{url.host}:{url.port or PORTS[scheme]}"
    return Proxy(address=address, user=user or None, password=password)


def proxy_of_environment(server: str, environment: Mapping[str, str]) -> Proxy | None:
    """Return the proxy that environment variables set for a server; None: connect directly.

    Raises:
        NotConfigured: the variable does not contain the address of a proxy.
    """
    url = _parsed(server)
    if url is None or not url.host:
        return None
    names = ("HTTPS_PROXY", "https_proxy") if url.scheme == "https" else ("HTTP_PROXY", "http_proxy")
    name = next((name for name in names if environment.get(name)), None)
    exceptions = environment.get("NO_PROXY") or environment.get("no_proxy") or ""
    port = url.port or PORTS.get(url.scheme or "", 0)
    if name is None or connects_directly(url.host.strip("[]"), port, exceptions):
        return None
    return proxy_named(environment[name].strip(), name)


def connects_directly(host: str, port: int, exceptions: str) -> bool:
    """Return whether to connect without a proxy: to this machine itself, and to the hosts in NO_PROXY.

    Args:
        host: the name or address of the server; an IPv6 address is without brackets.
        port: the port of the connection.
        exceptions: the text of NO_PROXY: names (including their subdomains), addresses and networks,
            separated by commas. Names and addresses may have a port. `*` matches all hosts.
    """
    host = host.lower().rstrip(".")
    address = _address(host)
    if host == "localhost" or (address is not None and address.is_loopback):
        return True
    entries = (entry.strip().lower() for entry in exceptions.split(","))
    return any(_covers(entry, host, address, port) for entry in entries if entry)


def _covers(
    entry: str, host: str, address: ipaddress.IPv4Address | ipaddress.IPv6Address | None, port: int
) -> bool:
    if entry == "*":
        return True
    if "/" in entry:
        return address is not None and _in_network(address, entry)
    name, its_port = _split(entry)
    if not name or its_port not in ("", str(port)):
        return False
    its_address = _address(name)
    if address is not None or its_address is not None:
        return address == its_address
    if name.startswith(("*.", ".")):  # such an entry matches subdomains, but not the domain itself
        return host.endswith(name.removeprefix("*"))
    return host == name or host.endswith(f".{name}")


def _split(entry: str) -> tuple[str, str]:
    """Return name and port of an entry; the port is "" if the entry has no port."""
    if _address(entry.strip("[]")) is not None:
        return entry.strip("[]"), ""
    name, colon, port = entry.rpartition(":")
    return (name.strip("[]"), port) if colon else (entry, "")


def _in_network(address: ipaddress.IPv4Address | ipaddress.IPv6Address, network: str) -> bool:
    try:
        return address in ipaddress.ip_network(network, strict=False)
    except ValueError:
        return False


def _address(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(text)
    except ValueError:
        return None


def _parsed(text: str) -> Url | None:
    try:
        return parse_url(text)
    except LocationParseError:
        return None
