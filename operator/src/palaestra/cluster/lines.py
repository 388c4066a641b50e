"""The lines of an answer that goes on, such as the log of a container that runs."""

import time
from collections.abc import Iterator

from urllib3 import BaseHTTPResponse

from palaestra.cluster.errors import Unreachable
from palaestra.cluster.transport import read_some


def lines(response: BaseHTTPResponse, deadline: float) -> Iterator[str]:
    """Yield lines without their ends, as soon as each is whole; the last one also where it has no end.

    Args:
        response: closed at the end.
        deadline: on the monotonic clock; looked at whenever something came.

    Raises:
        Unreachable: the connection broke, was silent for too long, or the answer did not end in time.
    """
    pending = b""
    try:
        while part := read_some(response):
            *whole, pending = (pending + part).split(b"\n")
            yield from (line.decode(errors="replace") for line in whole)
            if time.monotonic() > deadline:
                raise Unreachable(0, "Timeout", "the answer did not end in time")
        if pending:
            yield pending.decode(errors="replace")
    finally:
        response.close()
