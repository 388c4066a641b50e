"""The deadlines of all requests to the API server, and the waits before retries."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field

JITTER = 0.5  # a wait is shortened by up to this share, so that many clients do not retry at the same time


@dataclass(frozen=True, slots=True, kw_only=True)
class Backoff:
    """Waits that double from `first_s` to `cap_s`, each shortened at random.

    Attributes:
        first_s: the upper limit of the first wait in seconds, above 0.
        cap_s: the upper limit of all waits in seconds.
        chance: returns random numbers in [0, 1).
    """

    first_s: float
    cap_s: float
    chance: Callable[[], float] = random.random

    def wait_s(self, failures: int) -> float:
        """Return the seconds to wait after `failures` consecutive failures.

        The wait is at least half of `first_s` and at most `cap_s`. After n failures it is at most `first_s *
        2**(n-1)`.
        """
        doublings = min(max(failures, 1) - 1, 64)
        longest_s = min(self.first_s * 2.0**doublings, self.cap_s)
        return longest_s * (1 - JITTER * self.chance())


@dataclass(frozen=True, slots=True, kw_only=True)
class Timeouts:
    """All deadlines and waits of a connection, in seconds.

    Attributes:
        connect_s: the deadline for establishing a connection.
        call_s: the deadline for one request and its whole response, including waits for a busy server.
        watch_s: shortest and longest duration of one watch. The duration is random between these limits, so
            that watches end at different times.
        silence_s: longest silence on a watch. An API server sends a bookmark about every 60 s, so a longer
            silence means a dead connection.
        again: the waits after failed lists or watches.
        turned_away: the waits after a response 429, in addition to the wait in its Retry-After header.
    """

    connect_s: float = 5.0
    call_s: float = 10.0
    watch_s: tuple[float, float] = (300.0, 600.0)
    silence_s: float = 90.0
    again: Backoff = field(default_factory=lambda: Backoff(first_s=0.5, cap_s=30.0))
    turned_away: Backoff = field(default_factory=lambda: Backoff(first_s=0.2, cap_s=2.0))
