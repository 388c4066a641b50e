"""A pod's service account: two files, which the kubelet keeps up to date, and two environment variables.

They are read here, because the official client needs 10 MiB of memory to read them.
"""

import ipaddress
import os
import socket
import ssl
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.request import getproxies, proxy_bypass

from urllib3 import PoolManager, ProxyManager

from palaestra.cluster.access import POOL, Access, channel_options
from palaestra.cluster.errors import NotConfigured, Unreachable

FILES = Path("/var/run/secrets/kubernetes.io/serviceaccount")
FRESH_S = 60.0  # a kubelet replaces a token minutes before it expires
HOST, PORT = "KUBERNETES_SERVICE_HOST", "KUBERNETES_SERVICE_PORT"
# The kernel finds peers that are gone, also behind silent proxies.
KEPT_ALIVE = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),  # as urllib3 has it, whose default these options replace
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 30),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 30),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 9),
)


def account(files: Path | None = None, clock: Callable[[], float] = time.monotonic) -> Access:
    """Return the access of the pod in which this process runs; `files` is the folder of its account.

    Raises:
        NotConfigured: this process does not run in a pod, or the pod has no account.
    """
    folder = files or FILES
    host, port = os.environ.get(HOST), os.environ.get(PORT)
    if not host or not port:
        raise NotConfigured(f"{HOST} and {PORT} are not set, as they are in a pod")
    authority = folder / "ca.crt"
    if not _read(authority):
        raise NotConfigured(f"{authority} is missing or empty")
    if not _read(folder / "token"):
        raise NotConfigured(f"{folder / 'token'} is missing or empty")
    proxy = _proxy(host)
    tls: dict[str, Any] = {"cert_reqs": ssl.CERT_REQUIRED, "ca_certs": str(authority)}
    options: dict[str, Any] = {**tls, "maxsize": POOL, "socket_options": KEPT_ALIVE}
    return Access(
        host=f"https://[{host}]:{port}" if ":" in host else f"https://{host}:{port}",
        pool=PoolManager(**options) if proxy is None else ProxyManager(proxy, **options),
        authorization=Token(folder / "token", clock),
        channel=channel_options(tls, proxy),
    )


class Token:
    """The token of a service account, read again every minute, because kubelets replace it."""

    def __init__(self, file: Path, clock: Callable[[], float]) -> None:
        self._file = file
        self._clock = clock
        self._text = ""
        self._read_at = float("-inf")

    def __call__(self) -> str:
        """Return the header `Authorization` with the token.

        Raises:
            Unreachable: the token cannot be read.
        """
        if self._clock() - self._read_at >= FRESH_S:
            self._text = _read(self._file)
            if not self._text:
                raise Unreachable(0, "NoCredentials", f"{self._file} is missing or empty")
            self._read_at = self._clock()
        return f"Bearer {self._text}"


def _read(file: Path) -> str:
    """Return the text of a file; "" if it cannot be read."""
    try:
        return file.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError):
        return ""


def _proxy(host: str) -> str | None:
    """Return the proxy that the environment names for a host; None without one."""
    proxies = getproxies()
    direct = proxy_bypass(host) or any(_covers(pattern, host) for pattern in proxies.get("no", "").split(","))
    return None if direct else proxies.get("https")


def _covers(network: str, host: str) -> bool:
    """Return whether a network such as `10.0.0.0/8` contains the address `host`."""
    try:
        return ipaddress.ip_address(host) in ipaddress.ip_network(network.strip(), strict=False)
    except ValueError:
        return False
