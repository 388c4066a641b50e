"""The address of an API server, the connections to it, and the credentials for it."""

from collections.abc import Callable
from dataclasses import dataclass

from urllib3 import PoolManager

from palaestra.cluster.proxies import Proxy

Headers = tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Access:
    """An API server's address, and the credentials for it.

    Attributes:
        host: the address, such as `https://10.0.0.1:443`.
        pool: connections with the TLS settings for that server, through its proxy.
        authorization: returns the header `Authorization`, or None. Only one thread at a time calls the
            function. The function raises Unreachable if the credentials cannot be read.
        headers: additional headers of every request, for impersonation. The same name may occur several
            times.
        proxy: the proxy of all connections, for error messages; None without a proxy.
    """

    host: str
    pool: PoolManager
    authorization: Callable[[], str | None]
    headers: Headers = ()
    proxy: Proxy | None = None
