"""How long to wait before trying again: doubling, capped, and never in step with others."""

import random
from collections.abc import Callable
from dataclasses import dataclass

JITTER = 0.5  # a wait is cut by up to this share, so that many clients do not come back at once


@dataclass(frozen=True, slots=True, kw_only=True)
class Backoff:
    """Waits that double from `first_s` to `cap_s`, each shortened at random.

    Attributes:
        first_s: longest first wait in seconds, above 0.
        cap_s: longest wait in seconds.
        chance: returns numbers in [0, 1).
    """

    first_s: float
    cap_s: float
    chance: Callable[[], float] = random.random

    def wait_s(self, failures: int) -> float:
        """Return the seconds to wait after so many failures in a row.

        At least half of `first_s` and at most `cap_s`; after n failures at most `first_s * 2**(n-1)`.
        """
        doublings = min(max(failures, 1) - 1, 64)
        longest_s = min(self.first_s * 2.0**doublings, self.cap_s)
        return longest_s * (1 - JITTER * self.chance())
