"""All writes to the cluster; while another operator leads, each write is refused.

A write that was decided in an earlier term as leader is refused too. The thread may have been delayed between
decision and write, and another operator may have led in that time.
"""

import threading
from collections.abc import Callable, Mapping
from typing import Any

from palaestra.cluster import Api, Resource
from palaestra.cluster.resources import TRAINING_JOBS, resource_of
from palaestra.errors import PalaestraError
from palaestra.objects import Object


class NotLeading(PalaestraError):
    """Another operator may lead now, so the write is refused; the leader reconciles the job."""


class FencedClient:
    """Writes to the cluster while this operator leads.

    Each method raises NotLeading if this operator does not lead, and ApiError if the API server refuses.

    Args:
        api: the cluster.
        term: returns the number of this operator's current term as leader; None: it does not lead.
    """

    def __init__(self, api: Api, term: Callable[[], int | None]) -> None:
        self._api = api
        self._term = term
        self._look = threading.local()

    def begin(self) -> None:
        """Begin a reconcile: this thread may write only until the current term of the leader ends."""
        self._look.term = self._term()

    def create(self, obj: Object) -> Object:
        """Create an object and return it as stored."""
        self._check()
        return self._api.create(resource_of(obj), obj)

    def apply(self, obj: Object) -> Object:
        """Apply (create or update) an object that only the operator writes."""
        self._check()
        return self._api.apply(obj)

    def merge(self, resource: Resource, namespace: str, name: str, patch: Object, version: str) -> Object:
        """Merge `patch` into an object, if the object still has this resourceVersion."""
        self._check()
        return self._api.merge(resource, namespace, name, patch, resource_version=version)

    def delete(self, resource: Resource, namespace: str, name: str, *, uid: str, version: str) -> None:
        """Delete the object with this uid and resourceVersion, but not a later object of the same name."""
        self._check()
        self._api.delete(resource, namespace, name, uid=uid, resource_version=version)

    def evict(self, namespace: str, name: str, uid: str) -> None:
        """Evict the pod with this uid, but not a later pod of the same name."""
        self._check()
        self._api.evict(namespace, name, uid=uid)

    def status(self, job: Object, patch: Object) -> Object:
        """Merge `patch` into the status if the job has not changed since `job`; return the stored job."""
        self._check()
        metadata = job["metadata"]
        return self._api.merge(
            TRAINING_JOBS,
            metadata["namespace"],
            metadata["name"],
            {"status": patch},
            subresource="status",
            resource_version=metadata["resourceVersion"],
        )

    def _check(self) -> None:
        term = self._term()
        if term is None or term != getattr(self._look, "term", term):
            raise NotLeading(
                "another operator may have acquired the Lease since the decision, so this write is refused"
            )


def difference(old: Any, new: Mapping[str, Any]) -> dict[str, Any]:
    """Return the merge patch (RFC 7386) that changes `old` to `new`; empty if they are equal."""
    before: Mapping[str, Any] = old if isinstance(old, Mapping) else {}
    patch: dict[str, Any] = {key: None for key in before if key not in new}
    for key, value in new.items():
        if key not in before:
            patch[key] = value
        elif isinstance(value, Mapping) and isinstance(before[key], Mapping):
            if part := difference(before[key], value):
                patch[key] = part
        elif before[key] != value:
            patch[key] = value
    return patch
