"""A kubeconfig, read by the official client, which supports every kind of credentials that kubectl does.

This module is imported only if a kubeconfig is used, because the client needs 10 MiB of memory.
"""

import ssl
from typing import Any

import yaml
from kubernetes.client.configuration import Configuration
from kubernetes.client.rest import RESTClientObject
from kubernetes.config import ConfigException, list_kube_config_contexts, load_kube_config

from palaestra.cluster.access import POOL, Access, channel_options
from palaestra.cluster.errors import NotConfigured, Unreachable

WRONG = (ConfigException, OSError, ValueError, TypeError, KeyError, yaml.YAMLError)


def access(files: str, context: str | None) -> Access:
    """Return the access of a context in a kubeconfig; None is the current context.

    Raises:
        NotConfigured: it cannot be read, or names no API server.
    """
    configuration = Configuration()
    configuration.connection_pool_maxsize = POOL
    configuration.keep_alive = True  # the kernel finds peers that are gone, also behind silent proxies
    try:
        load_kube_config(files, context=context, client_configuration=configuration)
    except WRONG as error:
        raise NotConfigured(_fact(files, error)) from error
    host = configuration.host.rstrip("/")

    def authorization() -> str | None:
        try:
            settings = configuration.auth_settings()  # reads a token again, or runs a plugin
        except (ConfigException, OSError) as error:
            raise Unreachable(0, "NoCredentials", f"credentials for {host}: {error}") from error
        return str(settings["BearerToken"]["value"]) if "BearerToken" in settings else None

    return Access(
        host=host,
        pool=RESTClientObject(configuration).pool_manager,
        authorization=authorization,
        channel=channel_options(_tls(configuration), configuration.proxy),
    )


def namespace(files: str, context: str | None) -> str | None:
    """Return the namespace that a context of a kubeconfig names; None: it names none.

    Raises:
        NotConfigured: it has no such context, or cannot be read.
    """
    try:
        contexts: Any = list_kube_config_contexts(files)
    except WRONG as error:
        raise NotConfigured(_fact(files, error)) from error
    known, current = contexts
    chosen = next((entry for entry in known if entry["name"] == context), None) if context else current
    if chosen is None:
        raise NotConfigured(
            f"--context: {files} has no {context!r}; `kubectl config get-contexts` names them"
        )
    found = chosen["context"].get("namespace")
    return str(found) if found else None


def _fact(files: str, error: Exception) -> str:
    return f"{files}: {' '.join(str(error).split())}"  # YAML's mistakes come on several lines


def _tls(configuration: Configuration) -> dict[str, Any]:
    """Return the TLS settings of the client's configuration as options of the websocket library."""
    verified = configuration.verify_ssl
    return {
        "cert_reqs": ssl.CERT_REQUIRED if verified else ssl.CERT_NONE,
        "check_hostname": verified and configuration.assert_hostname is not False,
        "ca_certs": configuration.ssl_ca_cert,
        "certfile": configuration.cert_file,
        "keyfile": configuration.key_file,
        "server_hostname": configuration.tls_server_name,
    }
