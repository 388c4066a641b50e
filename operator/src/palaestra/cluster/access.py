"""The way to an API server: its address, connections and credentials, wherever they come from."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import urlsplit

from urllib3 import PoolManager

POOL = 32  # connections kept open: more than there are workers and watches


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """Where an API server is, and how to be let in.

    Attributes:
        host: address, as `https://10.0.0.1:443`.
        pool: connections, with TLS as it has to be.
        authorization: returns the header of that name, None without one; called by one thread at a time.
            Raises Unreachable where the credentials cannot be read.
        channel: options of a websocket to that host, its TLS and a proxy among them.
    """

    host: str
    pool: PoolManager
    authorization: Callable[[], str | None]
    channel: Mapping[str, Any]


def channel_options(tls: Mapping[str, Any], proxy: str | None) -> dict[str, Any]:
    """Return options of a websocket; of `tls` those that are None are left out."""
    options: dict[str, Any] = {"sslopt": {name: value for name, value in tls.items() if value is not None}}
    if proxy is not None:
        address = urlsplit(proxy)
        options |= {"http_proxy_host": address.hostname, "http_proxy_port": address.port}
        options["proxy_type"] = "http"
    return options
