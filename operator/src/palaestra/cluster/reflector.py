"""A cache that follows the API server: the reflector lists the objects in pages, and then watches forever.

- If a watch is silent for longer than the interval of bookmarks, the reflector opens a new watch.
- If the version has expired (410, as a response or as an event), the reflector lists again. The reflector
  then removes and reports each object that the new list lacks, so no deletion is missed.
- After each consecutive failure, the reflector waits longer before it retries.
"""

import random
import threading
import time
from collections.abc import Callable

import structlog

from palaestra.cluster.api import Api, Page
from palaestra.cluster.errors import ApiError, Gone
from palaestra.cluster.resources import Resource
from palaestra.cluster.store import Store, key_of
from palaestra.cluster.watch import Watch
from palaestra.objects import Key, Object

log = structlog.get_logger("palaestra.cluster")

Keep = Callable[[Object], Object]
Changed = Callable[[Object], None]


class Reflector:
    """The objects of one kind; the cache may be slightly behind the cluster.

    Attributes:
        store: the cached objects; any thread may read it.
    """

    def __init__(
        self,
        api: Api,
        resource: Resource,
        *,
        namespace: str | None = None,
        labels: str | None = None,
        keep: Keep,
        changed: Changed,
    ) -> None:
        """Prepare the reflector, which sends no request before `start`.

        Args:
            api: the API server.
            resource: the kind of objects.
            namespace: the namespace to watch; None for all namespaces.
            labels: the label selector of the objects to watch; None: all objects of the kind.
            keep: reduces an object to the copy that the store gets. The metadata of the copy must have
                namespace, name and labels.
            changed: called after the store is updated, with the cached copy of the object; for a deleted
                object, with the last cached copy. The reflector's thread calls this function, so it must
                return at once.
        """
        self.store = Store()
        self._api = api
        self._resource = resource
        self._namespace = namespace
        self._labels = labels
        self._keep = keep
        self._changed = changed
        self._version: str | None = None
        self._heard = False
        self._watch: Watch | None = None
        self._synced = threading.Event()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reflect {resource.plural}", daemon=True)

    @property
    def synced(self) -> bool:
        """Return whether a complete list was read at least once."""
        return self._synced.is_set()

    def wait_synced(self, deadline_s: float) -> bool:
        """Wait for the first complete list; return whether it was read within `deadline_s`."""
        return self._synced.wait(deadline_s)

    def start(self) -> None:
        """Start the thread; call it once."""
        self._thread.start()

    def stop(self, deadline_s: float = 1.0) -> None:
        """Close the watch and wait at most `deadline_s` for the thread, which is a daemon."""
        self._stopping.set()
        watch = self._watch
        if watch is not None:
            watch.close()
        if self._thread.ident is not None:
            self._thread.join(deadline_s)

    def _run(self) -> None:
        failures, waited_s = 0, 0.0
        while not self._stopping.is_set():
            started, self._heard = time.monotonic(), False
            error = self._turn()
            lasted_s = time.monotonic() - started
            failures = 1 if self._heard and lasted_s >= waited_s else failures + 1
            waited_s = self._api.limits.again.wait_s(failures)
            if error and not self._stopping.is_set():
                log.warning(
                    "watch broken",
                    resource=self._resource.plural,
                    reason=error.reason,
                    error=str(error),
                    again_in_s=round(waited_s, 2),
                )
            self._stopping.wait(waited_s)

    def _turn(self) -> ApiError | None:
        """List if necessary, and watch until the watch ends; return the error that ended it, or None."""
        try:
            if self._version is None:
                self._version = self._relist()
            self._follow(self._version)
        except Gone:
            self._version = None
            log.info("lists again", resource=self._resource.plural)
        except ApiError as error:
            return error
        return None

    def _relist(self) -> str:
        """Update the store from a complete list, and return the list's version."""
        gone, version = self.store.keys(), ""
        size = self._resource.page
        for page in self._api.pages(self._resource, self._namespace, labels=self._labels, limit=size):
            version = page.version
            gone -= self._put_all(page)
            del page  # otherwise this page would stay in memory while the next page is read
        for key in gone:
            self._drop(key)
        self._synced.set()
        return version

    def _put_all(self, page: Page) -> set[Key]:
        for item in page.items:
            self._put(item)
        return {key_of(item) for item in page.items}

    def _follow(self, version: str) -> None:
        shortest_s, longest_s = self._api.limits.watch_s
        seconds = random.uniform(shortest_s, longest_s)  # noqa: S311 - spreads load, not a secret
        watch = self._api.watch(
            self._resource, self._namespace, version=version, labels=self._labels, seconds=seconds
        )
        self._watch = watch
        if self._stopping.is_set():  # `stop` was called while the watch was opened
            watch.close()
        for event in watch:
            self._heard = True
            self._take(event["type"], event["object"])

    def _take(self, kind: str, obj: Object) -> None:
        self._version = str(obj["metadata"]["resourceVersion"])
        if kind in ("ADDED", "MODIFIED"):
            api_version = {"apiVersion": self._resource.api_version, "kind": self._resource.kind}
            self._put({**obj, **api_version})
        elif kind == "DELETED":
            self._drop(key_of(obj))

    def _put(self, obj: Object) -> None:
        try:
            kept = self._keep(obj)
            before = self.store.relabeled(kept)
            different = self.store.put(kept)
            if before is not None:  # the job in the old label no longer owns the object
                self._changed(before)
            if different:
                self._changed(kept)
        except Exception:  # an error about one object must not stop the work on other objects
            log.exception("object not cached", resource=self._resource.plural, key=key_of(obj))

    def _drop(self, key: Key) -> None:
        known = self.store.drop(*key)
        if known is None:
            return
        try:
            self._changed(known)
        except Exception:  # an error about one object must not stop the work on other objects
            log.exception("deletion not reported", resource=self._resource.plural, key=key)
