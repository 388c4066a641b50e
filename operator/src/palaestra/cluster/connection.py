"""Choose the API server and the identity: from a kubeconfig, or from the pod's service account."""

import os
from pathlib import Path

from palaestra.cluster.api import Api
from palaestra.cluster.client_config import Access
from palaestra.cluster.errors import CONFIGURE, NotConfigured
from palaestra.cluster.service_account import FILES, account
from palaestra.cluster.timeouts import Timeouts
from palaestra.cluster.transport import Transport

OWN_NAMESPACE = FILES / "namespace"
DEFAULT = "default"


def connect(kubeconfig: str | None = None, context: str | None = None, limits: Timeouts | None = None) -> Api:
    """Return the API server to use, without a request to it.

    Args:
        kubeconfig: the kubeconfig file; None for $KUBECONFIG, then ~/.kube/config, then the pod's service
            account.
        context: the context of the kubeconfig; None for the current context.
        limits: the deadlines; None for the defaults.

    Raises:
        NotConfigured: no API server is configured, or its credentials cannot be read.
        Unreachable: the identity provider of a kubeconfig does not respond.
    """
    files = kubeconfig or os.environ.get("KUBECONFIG") or _home()
    return Api(Transport(_access(files, context), limits or Timeouts()))


def _access(files: str | None, context: str | None) -> Access:
    if files:
        from palaestra.cluster.kubeconfig import access  # noqa: PLC0415 - 10 MiB, not needed in a pod

        return access(files, context)
    try:
        return account()
    except NotConfigured as error:
        raise NotConfigured(f"{error}; {CONFIGURE}") from error


def namespace_of(kubeconfig: str | None = None, context: str | None = None) -> str:
    """Return the namespace of the context or pod that `connect` uses with the same arguments.

    Raises:
        NotConfigured: the kubeconfig has no such context, or cannot be read.
    """
    files = kubeconfig or os.environ.get("KUBECONFIG") or _home()
    if not files:
        return own_namespace(DEFAULT)
    from palaestra.cluster.kubeconfig import namespace  # noqa: PLC0415 - as above

    return namespace(files, context) or DEFAULT


def own_namespace(default: str) -> str:
    """Return the namespace of the pod in which this process runs; outside a cluster, return `default`."""
    try:
        return OWN_NAMESPACE.read_text(encoding="ascii").strip() or default
    except (OSError, UnicodeDecodeError):
        return default


def _home() -> str | None:
    try:
        file = Path.home() / ".kube" / "config"
    except RuntimeError:  # the user has no home directory, for example the numeric user of a pod
        return None
    return str(file) if file.is_file() else None
