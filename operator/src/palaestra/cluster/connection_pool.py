"""Connections to an API server, directly or through a proxy: a pool, and one for each websocket."""

import socket
import ssl
from contextlib import ExitStack
from typing import Any

from urllib3 import PoolManager, ProxyManager
from urllib3.contrib.socks import SOCKSProxyManager
from urllib3.util import make_headers

from palaestra.cluster.proxies import Proxy

POOL = 32  # unused connections that stay open; with default options, the operator needs fewer connections
# With these options the kernel detects dead peers, even behind proxies that do not report them.
_TIMES = (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 30), ("TCP_KEEPCNT", 9))
KEPT_ALIVE = (
    # This is urllib3's only default option. It is repeated here because these options replace the default.
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    # macOS has no TCP_KEEPIDLE.
    *((socket.IPPROTO_TCP, getattr(socket, name), value) for name, value in _TIMES if hasattr(socket, name)),
)


def connections(
    context: ssl.SSLContext, proxy: Proxy | None = None, server_name: str | None = None
) -> PoolManager:
    """Return connections with these TLS settings, through `proxy` if it is not None.

    Args:
        context: the TLS settings that verify the server, and also a proxy with an https address.
        proxy: the proxy of all connections, or None.
        server_name: the name that the server's certificate must contain; None: the name of the host.
    """
    options: dict[str, Any] = {
        "maxsize": POOL,
        "socket_options": KEPT_ALIVE,
        "ssl_context": context,
        "server_hostname": server_name,
    }
    if proxy is None:
        return PoolManager(**options)
    if proxy.socks:
        return _through_socks(proxy, options)
    asking = make_headers(proxy_basic_auth=f"{proxy.user}:{proxy.password or ''}") if proxy.user else None
    return ProxyManager(proxy.address, proxy_headers=asking, proxy_ssl_context=context, **options)


def _through_socks(proxy: Proxy, options: dict[str, Any]) -> PoolManager:
    manager = SOCKSProxyManager(proxy.address, proxy.user, proxy.password, **options)
    its = manager.connection_pool_kw["_socks_options"]
    its["proxy_host"] = its["proxy_host"].strip("[]")  # an IPv6 address from urllib3 is in brackets
    return manager


def dialed(pool: PoolManager, server: str, wait_s: float) -> socket.socket:
    """Return a new TLS connection to a server, for one request only; the caller closes the connection.

    Raises:
        urllib3.exceptions.HTTPError, OSError: the connection was not established within `wait_s` seconds.
    """
    target = pool.connection_from_url(server)
    first = target.proxy or target
    # mypy sees only the protocol of these classes, and this protocol does not declare `sock`.
    connection: Any = target.ConnectionCls(
        host=first.host or "", port=first.port, timeout=wait_s, **target.conn_kw
    )
    if target.proxy is not None:
        connection.set_tunnel(target.host, target.port, target.proxy_headers, target.proxy.scheme)
    with ExitStack() as undo:
        undo.callback(connection.close)
        connection.connect()
        undo.pop_all()
    found: socket.socket = connection.sock
    return found
