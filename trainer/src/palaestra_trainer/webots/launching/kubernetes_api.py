"""The requests to the API server, with the official client's configuration, credentials and transport.

This module and those that import it need the package kubernetes, which is optional.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from http import HTTPStatus
from pathlib import Path

from kubernetes.client import ApiClient, Configuration
from kubernetes.config import ConfigException, load_incluster_config, load_kube_config
from urllib3.exceptions import HTTPError

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.kubernetes_objects import Object

JOBS = "/apis/batch/v1/namespaces/{namespace}/jobs"
PODS = "/api/v1/namespaces/{namespace}/pods"
EVENTS = "/api/v1/namespaces/{namespace}/events"
CONFIG_MAPS = "/api/v1/namespaces/{namespace}/configmaps"
POLICIES = "/apis/networking.k8s.io/v1/namespaces/{namespace}/networkpolicies"

_CALL_S = 20
_NAMESPACE = Path("/var/run/secrets/kubernetes.io/serviceaccount/namespace")
_RIGHTS = "set jupyter.simulators=true in the chart's values, or give the service account these rights"


class NamespaceClient:
    """A client of the cluster in which this program runs, for the namespace of this program.

    Attributes:
        namespace: the namespace of all objects.

    Raises:
        ConfigurationError: this program has neither a service account nor a kubeconfig.
    """

    def __init__(self) -> None:
        configuration = Configuration()
        try:
            if _NAMESPACE.exists():
                load_incluster_config(client_configuration=configuration)
            else:
                load_kube_config(client_configuration=configuration)
        except (ConfigException, OSError) as error:
            raise ConfigurationError(
                f"launcher kubernetes: this program has no access to a cluster ({error}); run it in a pod "
                'with a service account, or use launcher="process"'
            ) from error
        configuration.retries = False
        self._client = ApiClient(configuration)
        self.namespace = _own_namespace()

    def get(self, collection: str, name: str) -> Object | None:
        """Return an object; None if it does not exist."""
        return self._ask("GET", f"{collection}/{name}")

    def list(self, collection: str, **query: str) -> list[Object]:
        """Return the objects of a collection that a query selects, e.g. labelSelector="a=b"."""
        found = self._ask("GET", collection, query=query) or {}
        items: list[Object] = found["items"]
        return items

    def create(self, collection: str, content: Object) -> Object:
        """Create an object and return it as the server stores it."""
        return self._ask("POST", collection, content) or {}

    def merge(self, collection: str, name: str, change: Object) -> None:
        """Change fields of an object."""
        self._ask("PATCH", f"{collection}/{name}", change, kind="application/merge-patch+json")

    def delete(self, collection: str, name: str) -> None:
        """Delete an object with all that belongs to it; an object that does not exist is ignored."""
        self._ask("DELETE", f"{collection}/{name}", {"propagationPolicy": "Foreground"})

    def close(self) -> None:
        """Close the connections."""
        self._client.rest_client.pool_manager.clear()

    def _ask(
        self,
        method: str,
        path: str,
        body: Object | None = None,
        *,
        query: Mapping[str, str] | None = None,
        kind: str = "application/json",
    ) -> Object | None:
        """Return the response; None if the object does not exist.

        Raises:
            ConfigurationError: the server refuses the request, for the reason in the error's message, or does
                not respond.
        """
        serialized = self._client.param_serialize(
            method=method,
            resource_path=path,
            path_params={"namespace": self.namespace},
            query_params=list((query or {}).items()),
            header_params={"Accept": "application/json", "Content-Type": kind},
            body=body,
            auth_settings=["BearerToken"],
        )
        try:
            response = self._client.call_api(*serialized, _request_timeout=_CALL_S)
            text = response.read()
        except (HTTPError, OSError) as error:
            raise ConfigurationError(
                f"launcher kubernetes: the API server does not respond ({error})"
            ) from error
        if response.status == HTTPStatus.NOT_FOUND and method in {"GET", "DELETE"}:
            return None
        if response.status >= HTTPStatus.MULTIPLE_CHOICES:
            raise ConfigurationError(f"launcher kubernetes: {_said(response.status, text)}")
        answer: Object = json.loads(text)
        return answer


def _said(status: int, text: bytes) -> str:
    """Return the words of the API server's refusal, and for a missing right the remedy."""
    try:
        message = str(json.loads(text)["message"])
    except (ValueError, KeyError, TypeError):
        message = text.decode(errors="replace")[:200]
    forbidden = status == HTTPStatus.FORBIDDEN and " cannot " in message  # admission plugins send 403 too
    return f"the API server refused ({message}){f'; {_RIGHTS}' if forbidden else ''}"


def _own_namespace() -> str:
    if _NAMESPACE.exists():
        return _NAMESPACE.read_text().strip()
    return os.environ.get("PALAESTRA_NAMESPACE", "default")
