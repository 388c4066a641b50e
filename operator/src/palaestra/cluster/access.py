"""The address, connections and credentials of an API server."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from urllib3 import PoolManager

POOL = 32  # connections kept open: more than there are workers and watches


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """An API server's address, and the credentials for it.

    Attributes:
        host: address, as `https://10.0.0.1:443`.
        pool: connections, with the TLS settings of that server.
        authorization: returns the header of that name, None without one; called by one thread at a time.
            Raises Unreachable if the credentials cannot be read.
        channel: options of a websocket to that host, including its TLS and a proxy.
    """

    host: str
    pool: PoolManager
    authorization: Callable[[], str | None]
    channel: Mapping[str, Any]


def channel_options(tls: Mapping[str, Any], proxy: str | None) -> dict[str, Any]:
    """Return the options of a websocket; entries of `tls` that are None are left out."""
    options: dict[str, Any] = {"sslopt": {name: value for name, value in tls.items() if value is not None}}
    if proxy is not None:
        address = urlsplit(proxy)
        options |= {"http_proxy_host": address.hostname, "http_proxy_port": address.port}
        options["proxy_type"] = "http"
    return options
