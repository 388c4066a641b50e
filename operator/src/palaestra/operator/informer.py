"""The objects of one kind, watched in some namespaces or in all of them.

If the operator watches only some namespaces, each namespace has its own reflector, because one list request
covers one namespace or all.
"""

import time
from collections.abc import Mapping, Sequence

from palaestra.cluster import Api, Reflector, Resource
from palaestra.cluster.reflector import Changed, Keep
from palaestra.objects import Key, Object


class Informer:
    """The objects of one kind; the cached copies may be slightly behind the cluster.

    Args:
        api: the connection to the cluster.
        resource: the kind of the objects.
        namespaces: the namespaces to watch; empty: all namespaces.
        labels: the label selector of the objects to watch; None: all objects of the kind.
        keep: reduces an object to the copy that the cache gets.
        changed: called with the reduced copy of each object that changed.
    """

    def __init__(
        self,
        api: Api,
        resource: Resource,
        *,
        namespaces: Sequence[str] = (),
        labels: str | None = None,
        keep: Keep,
        changed: Changed,
    ) -> None:
        self.plural = resource.plural
        self._reflectors = tuple(
            Reflector(api, resource, namespace=namespace, labels=labels, keep=keep, changed=changed)
            for namespace in namespaces or (None,)
        )

    @property
    def synced(self) -> bool:
        """Return whether each namespace was listed completely at least once."""
        return all(reflector.synced for reflector in self._reflectors)

    def start(self) -> None:
        """Start the watches; call it once."""
        for reflector in self._reflectors:
            reflector.start()

    def stop(self, deadline_s: float) -> None:
        """Stop the watches, and wait at most `deadline_s` for them."""
        for reflector in self._reflectors:
            reflector.stop(0.0)
        ends = time.monotonic() + deadline_s
        for reflector in self._reflectors:
            reflector.stop(max(0.0, ends - time.monotonic()))

    def wait_synced(self, deadline_s: float) -> bool:
        """Wait at most `deadline_s`, and return whether each namespace was listed completely once."""
        ends = time.monotonic() + deadline_s
        return all(reflector.wait_synced(max(0.0, ends - time.monotonic())) for reflector in self._reflectors)

    def get(self, namespace: str, name: str) -> Object | None:
        """Return the cached copy of an object; None if the object does not exist."""
        found = (reflector.store.get(namespace, name) for reflector in self._reflectors)
        return next((obj for obj in found if obj is not None), None)

    def holds(self, namespace: str, name: str) -> bool:
        """Return whether an object exists, without decoding the cached copy."""
        return any(reflector.store.holds(namespace, name) for reflector in self._reflectors)

    def select(self, namespace: str | None, labels: Mapping[str, str]) -> list[Object]:
        """Return the objects with these labels in a namespace; None: in all watched namespaces."""
        return [obj for reflector in self._reflectors for obj in reflector.store.select(namespace, labels)]

    def keys(self) -> set[Key]:
        """Return namespace and name of all objects."""
        return set().union(*(reflector.store.keys() for reflector in self._reflectors))
