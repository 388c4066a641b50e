"""The changes of one object, until it is deleted or a deadline passes.

A watch that ends, fails or expires is restarted from the current object, but no version is yielded twice.
"""

import threading
import time
from collections.abc import Iterator

from palaestra.client.errors import TookTooLong
from palaestra.cluster import Api, ApiError, Resource
from palaestra.objects import Object

LONGEST_WATCH_S = 300.0
DELETED, BOOKMARK = "DELETED", "BOOKMARK"


class _Gone(Exception):
    """The object does not exist."""


def changes(
    api: Api, resource: Resource, namespace: str, name: str, *, deadline: float, uid: str = ""
) -> Iterator[Object]:
    """Yield the object, then yield it again after each change, until it does not exist.

    If the object is replaced by a new object of the same name, the iteration ends too.

    Args:
        api: the connection to the cluster.
        resource: kind of the object, with its API group and its name in URLs.
        namespace: the namespace of the object.
        name: the name of the object.
        deadline: the time on the monotonic clock by which the iteration must have ended.
        uid: uid of the object; empty: the uid of the first object found.

    Raises:
        TookTooLong: the deadline passed.
        ApiError: a request failed. After the object was found once, retryable errors are retried instead.
    """
    version, failures = "", 0
    while True:
        try:
            for found in _until_the_watch_ends(api, resource, namespace, name, deadline):
                failures = 0
                uid = uid or found["metadata"]["uid"]
                if found["metadata"]["uid"] != uid:
                    return
                if _version(found) != version:
                    version = _version(found)
                    yield found
        except _Gone:
            return
        except ApiError as error:
            if not (error.retryable and version):
                raise
        failures += 1
        threading.Event().wait(min(api.limits.again.wait_s(failures), _left(deadline)))
        if not _left(deadline):
            raise TookTooLong(
                f"{resource.kind} {name}: did not reach the expected state in time; "
                f"wait longer, or see `kubectl describe {resource.plural} {name}`"
            )


def _until_the_watch_ends(
    api: Api, resource: Resource, namespace: str, name: str, deadline: float
) -> Iterator[Object]:
    """Yield the object, then yield it again after each change until the watch ends; may raise _Gone."""
    only = f"metadata.name={name}"
    [page] = api.pages(resource, namespace, fields=only)
    if not page.items:
        raise _Gone
    yield page.items[0]
    seconds = min(_left(deadline), LONGEST_WATCH_S)
    for event in api.watch(resource, namespace, version=page.version, fields=only, seconds=seconds):
        if event["type"] == DELETED:
            raise _Gone
        if event["type"] != BOOKMARK:
            yield event["object"]


def _version(found: Object) -> str:
    return str(found["metadata"]["resourceVersion"])


def _left(deadline: float) -> float:
    return max(deadline - time.monotonic(), 0.0)
