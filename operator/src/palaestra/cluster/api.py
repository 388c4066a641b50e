"""Requests to an API server in plain JSON.

Each request has a deadline, and each kind of refusal raises an exception of its own. This module retries only
two kinds of requests, within the deadline of the call: a request that a busy server rejected (429), and a
read whose connection broke. For all other failed requests, the caller decides on a retry.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from palaestra.cluster.errors import Gone, NotFound
from palaestra.cluster.pod_logs import lines
from palaestra.cluster.resources import PODS, Resource, resource_of
from palaestra.cluster.transport import JSON, Call, OnRequest, Transport
from palaestra.cluster.watch import Watch
from palaestra.objects import Object

Objects = list[Object]
PAGE = 500
MANAGER = "palaestra-operator"
MERGE_PATCH = "application/merge-patch+json"
APPLY_PATCH = "application/apply-patch+yaml"  # the body is JSON, which is also valid YAML
LISTS_FROM_THE_START = 3
TABLE = "application/json;as=Table;v=v1;g=meta.k8s.io"
METADATA = "application/json;as={kind};g=meta.k8s.io;v=v1"
READS = {
    "get": "PartialObjectMetadata",
    "list": "PartialObjectMetadataList",
    "watch": "PartialObjectMetadata",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Page:
    """One page of a list.

    Attributes:
        items: the objects; apiVersion and kind are added, because the items of a list lack them.
        version: the resourceVersion of the whole list, from which a watch continues.
    """

    items: tuple[Object, ...]
    version: str


class Api:
    """An API server, used with one identity; several threads may use one object.

    Attributes:
        limits: the deadlines and the waits before retries.
    """

    def __init__(self, transport: Transport, call_s: float | None = None) -> None:
        self._transport = transport
        self.limits = transport.limits
        self._call_s = self.limits.call_s if call_s is None else call_s

    def within(self, call_s: float) -> "Api":
        """Return the same API server with another deadline for each call, in seconds."""
        return Api(self._transport, call_s)

    @property
    def on_request(self) -> OnRequest:
        """The hook that is called after every request: verb, plural, HTTP status (0: no response), seconds.

        The objects that `within` returns have the same hook. A watch is reported when it ends.
        """
        return self._transport.on_request

    @on_request.setter
    def on_request(self, hook: OnRequest) -> None:
        self._transport.on_request = hook

    def version(self) -> str:
        """Return the API server's version, such as `v1.36.4`."""
        return str(self._object(Call(verb="get", plural="version", path="/version")).get("gitVersion", ""))

    def serves(self, group_version: str) -> bool:
        """Return whether the API server serves a group and version, such as `kueue.x-k8s.io/v1beta1`."""
        try:
            self._object(Call(verb="get", plural="groups", path=f"/apis/{group_version}"))
        except NotFound:
            return False
        return True

    def schema(self, group_version: str, kind: str) -> Object:
        """Return the OpenAPI schema of a kind, which the API server publishes to every account.

        The API server publishes the schema of a custom resource some seconds after its definition was
        applied.

        Raises:
            NotFound: the API server publishes no schema of this kind.
        """
        path = f"/openapi/v3/apis/{group_version}"
        document = self._object(Call(verb="get", plural="openapi", path=path))
        group, _, version = group_version.rpartition("/")
        name = {"group": group, "version": version, "kind": kind}
        found: Objects = list(document.get("components", {}).get("schemas", {}).values())
        for resource in found:
            if name in resource.get("x-kubernetes-group-version-kind", ()):
                return resource
        raise NotFound(404, "NotFound", f"{path} has no schema of kind {kind}")

    def list(
        self,
        resource: Resource,
        namespace: str | None = None,
        *,
        labels: str | None = None,
        fields: str | None = None,
        limit: int = PAGE,
    ) -> Objects:
        """Return all matching objects as a consistent list, which is read in pages of `limit` objects.

        Namespace None means all namespaces. `labels` and `fields` are selectors as in kubectl, such as
        `palaestra.dev/job=x,palaestra.dev/replica` and `involvedObject.uid=…`.
        """
        for attempt in range(LISTS_FROM_THE_START):
            try:
                pages = self.pages(resource, namespace, labels=labels, fields=fields, limit=limit)
                return [item for page in pages for item in page.items]
            except Gone:  # the version of the list expired before the last page was read
                if attempt == LISTS_FROM_THE_START - 1:
                    raise
        raise AssertionError("unreachable: the last attempt returns or raises")

    def pages(
        self,
        resource: Resource,
        namespace: str | None = None,
        *,
        labels: str | None = None,
        fields: str | None = None,
        limit: int = PAGE,
    ) -> Iterator[Page]:
        """Yield a list page by page, so that at most one page is in memory.

        Raises:
            Gone: the version of the list has expired; read the list again from its first page.
        """
        query = {"limit": str(limit), "labelSelector": labels, "fieldSelector": fields, "continue": None}
        while True:
            answer = dict(self._object(_call("list", resource, namespace, query=query)))
            metadata = answer.get("metadata") or {}
            items = tuple(_complete(resource, item) for item in answer.pop("items", None) or ())
            yield Page(items=items, version=str(metadata.get("resourceVersion", "")))
            del items  # frees this page before the next page is read
            query["continue"] = metadata.get("continue")
            if not query["continue"]:
                return

    def get(self, resource: Resource, namespace: str | None, name: str) -> Object:
        """Return one object.

        Raises:
            NotFound: the object does not exist.
        """
        return _complete(resource, self._object(_call("get", resource, namespace, name)))

    def table(
        self,
        resource: Resource,
        namespace: str | None = None,
        name: str | None = None,
        *,
        labels: str | None = None,
    ) -> Object:
        """Return one object or a list as the `Table` that the API server renders for people.

        Raises:
            NotFound: the object does not exist.
        """
        call = _call("get" if name else "list", resource, namespace, name, query={"labelSelector": labels})
        return self._object(replace(call, accept=TABLE))

    def create(self, resource: Resource, obj: Object, *, dry_run: bool = False) -> Object:
        """Create an object in its `metadata.namespace`, and return the stored object.

        With `dry_run` the API server runs all its checks, including admission, and does not store the object.

        Raises:
            AlreadyExists: an object of this name exists.
            Invalid: the object is invalid; the message names the field.
        """
        query = {"dryRun": "All" if dry_run else None}
        return self._object(
            _call("create", resource, _namespace(obj), query=query).sending(obj, method="POST")
        )

    def merge(
        self,
        resource: Resource,
        namespace: str | None,
        name: str,
        patch: Object,
        *,
        subresource: str | None = None,
        resource_version: str | None = None,
    ) -> Object:
        """Change the fields in `patch` (RFC 7386: null removes, lists are replaced); return the new object.

        `subresource` may be `status`. With a `resource_version`, the API server refuses the change if the
        object has another version.

        Raises:
            Conflict: the object has another version.
        """
        if resource_version is not None:
            metadata = {**patch.get("metadata", {}), "resourceVersion": resource_version}
            patch = {**patch, "metadata": metadata}
        call = _call("patch", resource, namespace, name, subresource=subresource)
        return self._object(call.sending(patch, method="PATCH", media_type=MERGE_PATCH))

    def apply(self, obj: Object, *, manager: str = MANAGER, force: bool = True) -> Object:
        """Apply the fields in `obj` (server-side apply), and return the stored object.

        A field that the same manager applied before and that `obj` does not contain is removed.

        Raises:
            Conflict: another manager owns a field, and `force` is false.
        """
        query = {"fieldManager": manager, "force": "true" if force else "false"}
        name = str(obj["metadata"]["name"])
        call = _call("apply", resource_of(obj), _namespace(obj), name, query=query)
        return self._object(call.sending(obj, method="PATCH", media_type=APPLY_PATCH))

    def delete(
        self,
        resource: Resource,
        namespace: str | None,
        name: str,
        *,
        uid: str | None = None,
        resource_version: str | None = None,
        propagation: str = "Background",
    ) -> None:
        """Delete one object; `propagation` selects how the API server deletes its dependent objects.

        `propagation` is `Background`, `Foreground` or `Orphan`. With a `uid`, a later object of the same name
        is not deleted. With a `resource_version`, the object is deleted only if it still has this version.

        Raises:
            NotFound: the object does not exist.
            Conflict: the object of this name has another uid or version.
        """
        options: dict[str, Any] = {
            "kind": "DeleteOptions",
            "apiVersion": "v1",
            "propagationPolicy": propagation,
        }
        wanted = {"uid": uid, "resourceVersion": resource_version}
        if preconditions := {name: value for name, value in wanted.items() if value is not None}:
            options["preconditions"] = preconditions
        self._object(_call("delete", resource, namespace, name).sending(options, method="DELETE"))

    def evict(self, namespace: str, name: str, *, uid: str) -> None:
        """Evict the pod with this uid.

        If a disruption budget refuses the eviction, the API server responds with 429, as if it were busy.
        The refusal may last for days, so the request is not retried.

        Raises:
            NotFound: no pod has this name.
            Conflict: the pod of this name has another uid.
            TooManyRequests: a disruption budget does not allow an eviction now, or the server is busy.
        """
        eviction = {
            "apiVersion": "policy/v1",
            "kind": "Eviction",
            "metadata": {"namespace": namespace, "name": name},
            "deleteOptions": {"preconditions": {"uid": uid}},
        }
        call = _call("create", PODS, namespace, name, subresource="eviction")
        self._object(replace(call.sending(eviction, method="POST"), waits=False))

    def watch(
        self,
        resource: Resource,
        namespace: str | None = None,
        *,
        version: str,
        labels: str | None = None,
        fields: str | None = None,
        seconds: float,
    ) -> Watch:
        """Return the changes after `version`, the version of a list or of an earlier watch's last event.

        The API server ends the watch after `seconds`. Iterate over the watch once, until it ends or is
        closed.

        Raises:
            Gone: the version has expired; this method or the iterator raises the error.
        """
        query = {
            "watch": "true",
            "allowWatchBookmarks": "true",
            "resourceVersion": version,
            "timeoutSeconds": str(max(1, round(seconds))),
            "labelSelector": labels,
            "fieldSelector": fields,
        }
        call = _call("watch", resource, namespace, query=query)
        silence_s = min(self.limits.silence_s, seconds + self.limits.call_s)
        return Watch(self._transport.open(call, silence_s=silence_s), call, self.on_request)

    def logs(
        self,
        namespace: str,
        pod: str,
        container: str,
        *,
        follow: bool = False,
        tail: int | None = None,
        within_s: float,
    ) -> Iterator[str]:
        """Yield the last `tail` lines of a container's log; with `follow`, also all later lines.

        Raises:
            NotFound: the pod does not exist.
            Invalid: the container has not started, or the pod has no container of that name.
            Unreachable: the connection broke, or the log did not end within `within_s`.
        """
        query = {
            "container": container,
            "follow": "true" if follow else None,
            "tailLines": None if tail is None else str(tail),
        }
        call = _call("get", PODS, namespace, pod, subresource="log", query=query)
        yield from self._lines(call, within_s)

    def proxied(self, namespace: str, pod: str, port: int, path: str) -> str:
        """Return a pod's response to a GET request through the API server; `path` has no leading slash.

        Raises:
            ApiError: the pod responds with an error, or the API server cannot reach it.
        """
        call = _call("get", PODS, namespace, f"{pod}:{port}", subresource=f"proxy/{path}")
        return "\n".join(self._lines(call, self._call_s))

    def execute(
        self, namespace: str, pod: str, container: str, command: Sequence[str], *, within_s: float
    ) -> Iterator[bytes]:
        """Run a command in a container, without input, and yield its standard output.

        Raises:
            CommandFailed: the exit code of the command is not 0.
            Unreachable: the connection broke, or the command did not end within `within_s`, so the output is
                incomplete.
            ApiError: the API server refuses.
        """
        deadline = time.monotonic() + within_s
        query = {"container": container, "command": command, "stdout": "true", "stderr": "true"}
        call = _call("create", PODS, namespace, pod, subresource="exec", query=query)
        yield from self._transport.output(call, deadline)

    def close(self) -> None:
        """Close all idle connections."""
        self._transport.close()

    def _lines(self, call: Call, within_s: float) -> Iterator[str]:
        deadline = time.monotonic() + within_s
        return lines(self._transport.open(call, silence_s=within_s), deadline)

    def _object(self, call: Call) -> Object:
        return self._transport.call(call, self._call_s)


def _call(
    verb: str,
    resource: Resource,
    namespace: str | None,
    name: str | None = None,
    *,
    subresource: str | None = None,
    query: Mapping[str, str | Sequence[str] | None] | None = None,
) -> Call:
    path = resource.address(namespace, name) + (f"/{subresource}" if subresource else "")
    accept = JSON
    if resource.metadata_only and verb in READS:
        accept = METADATA.format(kind=READS[verb])
    return Call(verb=verb, plural=resource.plural, path=path, query=query or {}, accept=accept)


def _namespace(obj: Object) -> str | None:
    namespace: str | None = obj["metadata"].get("namespace")
    return namespace


def _complete(resource: Resource, item: Object) -> Object:
    return {**item, "apiVersion": resource.api_version, "kind": resource.kind}
