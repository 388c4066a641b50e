"""Read a kubeconfig by the rules of kubectl.

The official client merges the files and supports auth-providers. This module reads all other fields, because
the official client ignores `as` and the errors of plugins. The module is imported only if a kubeconfig is
used, because the official client needs 10 MiB of memory.
"""

import base64
import logging
import os
import re
import ssl
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from kubernetes.client.configuration import Configuration
from kubernetes.client.exceptions import OpenApiException
from kubernetes.config import ConfigException
from kubernetes.config.kube_config import ConfigNode, KubeConfigLoader, KubeConfigMerger
from urllib3.exceptions import HTTPError, InsecureRequestWarning, LocationParseError
from urllib3.util import parse_url

from palaestra.cluster.client_config import Access
from palaestra.cluster.connection_pool import connections
from palaestra.cluster.errors import CONFIGURE, NotConfigured, Unreachable
from palaestra.cluster.identity import PROVIDER, Authorization, authorization
from palaestra.cluster.impersonation import impersonation
from palaestra.cluster.proxies import Proxy, proxy_named, proxy_of_environment
from palaestra.cluster.tls import add_identity, verification

WRONG = (ConfigException, OSError, ValueError, TypeError, KeyError, AttributeError, yaml.YAMLError)
CURRENT = "current-context"
SERVER, PROXY, INSECURE, NAME = "server", "proxy-url", "insecure-skip-tls-verify", "tls-server-name"
AUTHORITY, CERTIFICATE, KEY = "certificate-authority", "client-certificate", "client-key"
OIDC = "oidc"
CLUSTER_EXTENSION = "client.authentication.k8s.io/exec"
log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Entry:
    """A cluster or user of a kubeconfig, and the folder of its file, in which relative paths start."""

    content: Mapping[str, Any]
    folder: Path

    def bytes_of(self, field: str) -> bytes | None:
        """Return the content of the field's `-data`, or of the file that the field names, or None."""
        given, path = self.content.get(f"{field}-data"), self.content.get(field)
        if given:
            try:
                return base64.b64decode(str(given), validate=True)
            except ValueError as error:
                raise NotConfigured(f"{field}-data is not base64 ({error}); copy it again") from error
        return (self.folder / str(path)).read_bytes() if path else None


def access(files: str, context: str | None) -> Access:
    """Return the address and credentials of a context in a kubeconfig; context None: the current context.

    Raises:
        NotConfigured: the kubeconfig cannot be read, or one of its fields is invalid.
        Unreachable: the identity provider of an `auth-provider` does not respond.
    """
    try:
        merger, config = _merged(files)
        name = context or str(config[CURRENT])
        chosen = config["contexts"].get_with_name(name)["context"]
        cluster = _entry(config["clusters"].get_with_name(chosen["cluster"])["cluster"], "cluster")
        user = _user(config, chosen)
        return _access(files, merger, name, cluster, user)
    except Unreachable:  # this error is an OSError too, but the kubeconfig is right
        raise
    except WRONG as error:
        raise NotConfigured(_fact(files, error)) from error


def namespace(files: str, context: str | None) -> str | None:
    """Return the namespace of a context in a kubeconfig, or None.

    Raises:
        NotConfigured: the kubeconfig does not have the context, or cannot be read.
    """
    try:
        _, config = _merged(files)
        name = context or config[CURRENT]
        chosen = config["contexts"].get_with_name(name, safe=True)
        found = chosen["context"].safe_get("namespace") if chosen is not None else None
    except WRONG as error:
        raise NotConfigured(_fact(files, error)) from error
    if chosen is None:
        raise NotConfigured(
            f"--context: {files} has no context {name!r}; `kubectl config get-contexts` lists the contexts"
        )
    return str(found) if found else None


def _merged(files: str) -> tuple[KubeConfigMerger, Any]:
    """Return the kubeconfig's files and their merged content.

    The first file that names a current context determines the current context.
    """
    merger = KubeConfigMerger(files)
    config = merger.config
    if config is None:
        raise ConfigException("the file is missing")
    names = (content.get(CURRENT) for content in merger.config_files.values())
    if name := next(filter(None, names), None):
        config.value[CURRENT] = name
    return merger, config


def _entry(node: Any, field: str) -> _Entry:
    if not isinstance(node, ConfigNode) or not isinstance(node.value, Mapping):  # plain text is not a node
        raise ConfigException(f"the {field} of the context is not a mapping of fields")
    return _Entry(node.value, Path(node.path or "").absolute().parent)


def _user(config: ConfigNode, chosen: ConfigNode) -> _Entry:
    """Return the user of a context; an entry without fields if the kubeconfig has no such user."""
    name = chosen.safe_get("user")
    found = config["users"].get_with_name(name, safe=True) if name and config.safe_get("users") else None
    if found is None or not found.safe_get("user"):
        return _Entry({}, Path())
    return _entry(found["user"], "user")


def _access(files: str, merger: KubeConfigMerger, context: str, cluster: _Entry, user: _Entry) -> Access:
    authority, insecure = cluster.bytes_of(AUTHORITY), cluster.content.get(INSECURE) is True
    if authority and insecure:
        raise NotConfigured(f"{INSECURE} and {AUTHORITY} exclude each other; remove one")
    tls = _verification(authority, user, insecure=insecure)
    host = _host(cluster, secure=bool(authority or insecure))
    proxy = _proxy(cluster, host)
    found = Access(
        host=host,
        pool=connections(tls, proxy, cluster.content.get(NAME) or None),
        authorization=_authorization(merger, context, user, cluster, tls),
        headers=impersonation(user.content),
        proxy=proxy,
    )
    if insecure:
        _warn(files, host, proxy)
    return found


def _verification(authority: bytes | None, user: _Entry, *, insecure: bool) -> ssl.SSLContext:
    try:
        # Comments in a PEM file may be non-ASCII.
        pem = authority.decode("ascii", "ignore") if authority else None
        found = verification(pem=pem, verified=not insecure)
    except (OSError, ValueError) as error:
        raise NotConfigured(f"{AUTHORITY} is not a certificate in PEM ({error}); copy it again") from error
    certificate, key = user.bytes_of(CERTIFICATE), user.bytes_of(KEY)
    if certificate and key:
        try:
            add_identity(found, certificate, key)
        except OSError as error:
            raise NotConfigured(
                f"{CERTIFICATE} and {KEY} cannot be used together ({error}); copy both again"
            ) from error
    elif certificate or key:
        missing = KEY if certificate else CERTIFICATE
        raise NotConfigured(f"{missing} is missing, but {CERTIFICATE} and {KEY} work only together; set both")
    return found


def _host(cluster: _Entry, *, secure: bool) -> str:
    """Return the server's address; if the kubeconfig gives no scheme, `secure` selects https."""
    text = str(cluster.content.get(SERVER) or "").strip().rstrip("/")
    if text and "://" not in text:
        text = f"{'https' if secure else 'http'}://{text}"
    try:
        url = parse_url(text)
    except LocationParseError:
        url = parse_url("")
    if url.scheme not in ("http", "https") or not url.host:
        raise NotConfigured(f"{SERVER}: {text!r} is not an address; write https://HOST:PORT")
    return text


def _proxy(cluster: _Entry, host: str) -> Proxy | None:
    """Return the proxy of a cluster: from the kubeconfig, or else from the environment.

    NO_PROXY has no effect on a proxy from the kubeconfig.
    """
    named = cluster.content.get(PROXY)
    return proxy_named(str(named), PROXY) if named else proxy_of_environment(host, os.environ)


def _authorization(
    merger: KubeConfigMerger, context: str, user: _Entry, cluster: _Entry, tls: ssl.SSLContext
) -> Authorization:
    own = authorization(user.content, user.folder, _told_to_plugins(cluster), tls)
    provider = user.content.get(PROVIDER)
    if not provider or own() is not None:
        return own
    return _of_provider(merger, context, provider)


def _of_provider(merger: KubeConfigMerger, context: str, provider: Mapping[str, Any]) -> Authorization:
    if (name := provider.get("name")) != OIDC:
        raise NotConfigured(f"{PROVIDER}: {name!r} is no longer supported; use a plugin under `exec`")
    configuration = Configuration()
    base: Any = None  # with None, relative paths in a file start at the folder of that file
    loader = KubeConfigLoader(
        merger.config, active_context=context, config_base_path=base, config_persister=merger.save_changes
    )
    try:
        loader.load_and_set(configuration)  # requests a new token if the kubeconfig's token has expired
    except HTTPError as error:
        raise _no_token(error) from error

    def header() -> str | None:
        try:
            settings = configuration.auth_settings()  # requests a new token if the old one has expired
        except (*WRONG, OpenApiException, HTTPError) as error:
            raise _no_token(error) from error
        return str(settings["BearerToken"]["value"]) if "BearerToken" in settings else None

    return header


def _no_token(error: Exception) -> Unreachable:
    return Unreachable(0, "NoCredentials", f"{PROVIDER} returned no token ({error})")


def _told_to_plugins(cluster: _Entry) -> dict[str, Any]:
    """Return the information about the cluster for a plugin with `provideClusterInfo`."""
    authority = cluster.bytes_of(AUTHORITY)
    told = {
        name: cluster.content[name] for name in (SERVER, NAME, INSECURE, PROXY) if cluster.content.get(name)
    }
    if authority:
        told[f"{AUTHORITY}-data"] = base64.b64encode(authority).decode()
    for extension in cluster.content.get("extensions") or ():
        if extension.get("name") == CLUSTER_EXTENSION:
            told["config"] = extension.get("extension")
    return told


def _warn(files: str, host: str, proxy: Proxy | None) -> None:
    """Log one warning that the certificate is not verified. Silence urllib3's: it comes at each request."""
    log.warning(
        "%s: %s is set, so the certificate of %s is not verified: others may read your credentials",
        files,
        INSECURE,
        host,
    )
    first = parse_url(proxy.address if proxy else host).host or ""
    said = re.escape(f"Unverified HTTPS request is being made to host '{first.strip('[]')}'")
    warnings.filterwarnings("ignore", message=said, category=InsecureRequestWarning)


def _fact(files: str, error: Exception) -> str:
    said = " ".join(str(error).split())  # messages about invalid YAML have several lines
    return f"{files}: {said}" if isinstance(error, NotConfigured) else f"{files}: {said}; {CONFIGURE}"
