"""A check that a wait calls often; the check raises to end the wait."""

from __future__ import annotations

from collections.abc import Callable

Check = Callable[[], None]


def go_on() -> None:
    """Let the wait continue."""
