"""Which API server, and who we are: a kubeconfig (certificates, tokens, plugins) or a pod's service account.

A pod's token is read anew from its file every minute, as kubelets replace it.
"""

import os
from pathlib import Path
from typing import Any

import yaml
from kubernetes.client.configuration import Configuration
from kubernetes.config import (
    ConfigException,
    list_kube_config_contexts,
    load_incluster_config,
    load_kube_config,
)

from palaestra.cluster.api import Api
from palaestra.cluster.errors import NotConfigured
from palaestra.cluster.limits import Limits
from palaestra.cluster.transport import Transport

POOL = 32  # connections kept open: more than there are workers and watches
OWN_NAMESPACE = Path("/var/run/secrets/kubernetes.io/serviceaccount/namespace")
DEFAULT = "default"
REMEDY = "name a kubeconfig with --kubeconfig or KUBECONFIG, or run in a pod with a service account"


def connect(kubeconfig: str | None = None, context: str | None = None, limits: Limits | None = None) -> Api:
    """Return the API server to talk to; nothing is sent yet.

    Args:
        kubeconfig: a file; None for $KUBECONFIG, then ~/.kube/config, then the pod's service account.
        context: of the kubeconfig; None for its current one.
        limits: deadlines; None for the usual ones.

    Raises:
        NotConfigured: no API server is named, or its credentials cannot be read.
    """
    configuration = Configuration()
    configuration.connection_pool_maxsize = POOL
    files = kubeconfig or os.environ.get("KUBECONFIG") or _home()
    try:
        if files:
            load_kube_config(files, context=context, client_configuration=configuration)  # type: ignore[no-untyped-call]  # the client is half typed
        else:
            load_incluster_config(client_configuration=configuration)  # type: ignore[no-untyped-call]  # as above
    except (ConfigException, OSError, ValueError, TypeError, KeyError, yaml.YAMLError) as error:
        fact = " ".join(str(error).split())  # YAML's mistakes come on several lines
        raise NotConfigured(f"{files or 'service account'}: {fact}; {REMEDY}") from error
    return Api(Transport(configuration, limits or Limits()))


def namespace_of(kubeconfig: str | None = None, context: str | None = None) -> str:
    """Return the namespace of the connection that `connect` makes from the same arguments.

    Raises:
        NotConfigured: the kubeconfig has no such context, or cannot be read.
    """
    files = kubeconfig or os.environ.get("KUBECONFIG") or _home()
    if not files:
        return own_namespace(DEFAULT)
    try:
        contexts: Any = list_kube_config_contexts(files)  # type: ignore[no-untyped-call]  # as above
    except (ConfigException, OSError, ValueError, TypeError, KeyError, yaml.YAMLError) as error:
        raise NotConfigured(f"{files}: {' '.join(str(error).split())}; {REMEDY}") from error
    known, current = contexts
    chosen = next((each for each in known if each["name"] == context), None) if context else current
    if chosen is None:
        raise NotConfigured(
            f"--context: {files} has no {context!r}; `kubectl config get-contexts` names them"
        )
    return str(chosen["context"].get("namespace") or DEFAULT)


def own_namespace(default: str) -> str:
    """Return the namespace of the pod that this process runs in; outside a cluster, `default`."""
    try:
        return OWN_NAMESPACE.read_text(encoding="ascii").strip() or default
    except (OSError, UnicodeDecodeError):
        return default


def _home() -> str | None:
    try:
        file = Path.home() / ".kube" / "config"
    except RuntimeError:  # no home, as in a pod with a number for a user
        return None
    return str(file) if file.is_file() else None
