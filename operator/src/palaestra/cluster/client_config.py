"""The address, connections and credentials of an API server."""

from collections.abc import Callable
from dataclasses import dataclass

from urllib3 import PoolManager

from palaestra.cluster.proxies import Proxy

Headers = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """An API server's address, and the credentials for it.

    Attributes:
        host: address, as `https://10.0.0.1:443`.
        pool: connections, with the TLS settings of that server, through its proxy.
        authorization: returns the header of that name, None without one; called by one thread at a time.
            Raises Unreachable if the credentials cannot be read.
        headers: those that every request has besides: whom it acts for. A name may come several times.
        proxy: where all connections go first, for messages.
    """

    host: str
    pool: PoolManager
    authorization: Callable[[], str | None]
    headers: Headers = ()
    proxy: Proxy | None = None
