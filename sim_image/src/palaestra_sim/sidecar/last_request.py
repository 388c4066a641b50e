"""Remember when the last request came, so that a sidecar ends after its client was killed."""

import time
from collections.abc import Callable
from functools import partial

from palaestra_protocol.http import Response, Route, Routes


class LastRequest:
    """The time of the last request to a server; at first the time of the creation."""

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep
    ) -> None:
        self._clock = clock
        self._sleep = sleep
        self._at = clock()

    def noted(self, routes: Routes) -> Routes:
        """Return routes that give the same responses, and note the time of each request."""
        return {key: partial(self._answer, route) for key, route in routes.items()}

    def wait_for_silence(self, limit_s: float) -> None:
        """Return when no request has come for `limit_s` seconds."""
        while (left_s := self._at + limit_s - self._clock()) > 0:
            self._sleep(left_s)

    def _answer(self, route: Route, body: bytes) -> Response:
        self._at = self._clock()
        return route(body)
