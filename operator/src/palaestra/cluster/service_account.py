"""Read a pod's service account: two files, which the kubelet updates, and two environment variables.

The official client could read them too, but needs 10 MiB of memory.
"""

import os
import ssl
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from palaestra.cluster.client_config import Access
from palaestra.cluster.connection_pool import connections
from palaestra.cluster.errors import NotConfigured
from palaestra.cluster.proxies import proxy_of_environment
from palaestra.cluster.tls import verification
from palaestra.cluster.tokens import FRESH_S, FileToken, text_of

FILES = Path("/var/run/secrets/kubernetes.io/serviceaccount")
HOST, PORT = "KUBERNETES_SERVICE_HOST", "KUBERNETES_SERVICE_PORT"


def account(files: Path | None = None, clock: Callable[[], float] = time.monotonic) -> Access:
    """Return address and credentials for the pod in which this process runs; `files` is the account's folder.

    Raises:
        NotConfigured: this process does not run in a pod, or the pod has no usable service account.
    """
    folder = files or FILES
    host, port = os.environ.get(HOST), os.environ.get(PORT)
    if not host or not port:
        raise NotConfigured(f"{HOST} or {PORT} is not set, so this process does not run in a pod")
    authority = folder / "ca.crt"
    if not text_of(authority):
        raise NotConfigured(f"{authority} is missing, empty, unreadable or not ASCII")
    if not text_of(folder / "token"):
        raise NotConfigured(f"{folder / 'token'} is missing, empty, unreadable or not ASCII")
    server = f"https://[{host}]:{port}" if ":" in host else f"https://{host}:{port}"
    proxy = proxy_of_environment(server, os.environ)
    try:
        tls = verification(authority)
    except (OSError, ValueError) as error:
        raise NotConfigured(f"{authority} is not a certificate in PEM ({error})") from error
    return Access(
        host=server,
        pool=connections(tls, proxy),
        authorization=_Kept(FileToken(folder / "token", clock), authority, tls, clock),
        proxy=proxy,
    )


class _Kept:
    """The header and the certificate authority of a service account; the kubelet replaces both files.

    A new authority is trusted in addition to the old authority. As in client-go, the old authority stays
    trusted until the process ends.
    """

    def __init__(
        self, token: FileToken, authority: Path, tls: ssl.SSLContext, clock: Callable[[], float]
    ) -> None:
        self._token = token
        self._authority = authority
        self._known = text_of(authority)
        self._tls = tls
        self._clock = clock
        self._looked_at = clock()

    def __call__(self) -> str:
        """Return the header `Authorization`.

        Raises:
            Unreachable: the token cannot be read.
        """
        if self._clock() - self._looked_at >= FRESH_S:
            self._looked_at = self._clock()
            text = text_of(self._authority)
            if text and text != self._known:
                with suppress(OSError, ValueError):  # the file is incomplete; it is read again in a minute
                    self._tls.load_verify_locations(cadata=text)
                    self._known = text
        return self._token()
