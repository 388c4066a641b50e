"""The lines of a streamed response, such as the log of a running container."""

import time
from collections.abc import Iterator

from urllib3 import BaseHTTPResponse

from palaestra.cluster.errors import Unreachable
from palaestra.cluster.transport import read_some


def lines(response: BaseHTTPResponse, deadline: float) -> Iterator[str]:
    """Yield each line, without its line end, as soon as it is complete; at the end, yield an incomplete line.

    Args:
        response: the response, which is closed at the end.
        deadline: the time on the monotonic clock by which the response must have ended; it is checked after
            each read.

    Raises:
        Unreachable: the connection broke or was silent for too long, or the response did not end in time.
    """
    pending = b""
    try:
        while part := read_some(response):
            *whole, pending = (pending + part).split(b"\n")
            yield from (line.decode(errors="replace") for line in whole)
            if time.monotonic() > deadline:
                raise Unreachable(0, "Timeout", "the response did not end in time")
        if pending:
            yield pending.decode(errors="replace")
    finally:
        response.close()
