"""One watch: it yields events until it ends, its connection breaks, or another thread closes it."""

import json
import threading
import time
from collections.abc import Iterator
from typing import Any

from urllib3 import BaseHTTPResponse

from palaestra.cluster.errors import SERVER_ERROR, ApiError, Unreachable, from_status
from palaestra.cluster.transport import MOST_BYTES, Call, OnRequest, read_some


class Watch:
    """An iterable over the changes after a version; each event is a dict with `type` and `object`.

    The types are ADDED, MODIFIED, DELETED and BOOKMARK. An ERROR event is raised as an ApiError. If the last
    line is incomplete, the iterator raises Unreachable.
    """

    def __init__(self, response: BaseHTTPResponse, call: Call, on_request: OnRequest) -> None:
        self._response = response
        self._call = call
        self._on_request = on_request
        self._started = time.monotonic()
        self._closed = threading.Event()

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield events until the API server ends the watch, or until it is closed.

        Raises:
            Gone: the version has expired: list again.
            ApiError: another error from the API server.
            Unreachable: the connection broke, was silent for too long, or an event is not JSON.
        """
        code = self._response.status
        try:
            for line in self._lines():
                yield _event(line)
        except ApiError as error:
            code = error.code
            if not self._closed.is_set():
                raise
        finally:
            self._response.close()
            self._on_request(self._call.verb, self._call.plural, code, time.monotonic() - self._started)

    def close(self) -> None:
        """End the watch, and wake the thread that waits for an event. A second call has no effect."""
        self._closed.set()
        try:
            self._response.shutdown()
        except (ValueError, RuntimeError, OSError):  # the watch has already ended
            return

    def _lines(self) -> Iterator[bytes]:
        pending = bytearray()
        while part := read_some(self._response):
            pending += part
            if b"\n" in part:
                *lines, rest = bytes(pending).split(b"\n")
                pending = bytearray(rest)
                yield from filter(None, lines)
            elif len(pending) > MOST_BYTES:
                raise Unreachable(0, "TooLarge", f"an event has more than {MOST_BYTES} bytes")
        if pending and not self._closed.is_set():
            raise Unreachable(0, "Unreachable", "the watch ended in the middle of an event")


def _event(line: bytes) -> dict[str, Any]:
    try:
        event = json.loads(line)
        kind, found = str(event["type"]), dict(event["object"])
    except (ValueError, KeyError, TypeError) as error:
        raise Unreachable(0, "Unreadable", f"the watch sent a line that is not an event ({error})") from error
    if kind == "ERROR":
        code = found.get("code")
        raise from_status(code if isinstance(code, int) else SERVER_ERROR, found)
    return {"type": kind, "object": found}
