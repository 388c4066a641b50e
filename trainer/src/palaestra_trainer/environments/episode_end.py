"""Limit the steps of an episode while another part of the program waits for its end."""

from __future__ import annotations

import time
from collections.abc import Callable

import structlog

from palaestra_trainer.errors import ConfigurationError

log = structlog.get_logger(__name__)

MOST_STEPS = 100_000
SAY_EVERY_S = 60.0
REMEDY = "return truncated after a number of steps, or register it with max_episode_steps"


class EpisodeEnd:
    """Watches one episode; logs a line in every minute until its end, and raises after `MOST_STEPS` steps.

    Args:
        waits: name of the part of the program that waits, for messages.
        clock: a function that returns seconds from any starting point.
    """

    def __init__(self, waits: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._waits = waits
        self._clock = clock
        self._say_at = clock() + SAY_EVERY_S

    def not_after(self, steps: int) -> None:
        """Check the number of steps of the episode so far.

        Raises:
            ConfigurationError: the episode has `MOST_STEPS` steps or more.
        """
        if steps >= MOST_STEPS:
            raise ConfigurationError(
                f"environment.id: an episode has not ended after {steps} steps, and {self._waits} waits for "
                f"its end; {REMEDY}"
            )
        if self._clock() >= self._say_at:
            self._say_at = self._clock() + SAY_EVERY_S
            log.warning(
                "an episode has not ended", waits=self._waits, steps=steps, most=MOST_STEPS, remedy=REMEDY
            )
