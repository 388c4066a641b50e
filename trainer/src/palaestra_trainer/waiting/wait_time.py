"""Measure the time that each thread waits for simulators; the trainer itself uses the rest of a step."""

from __future__ import annotations

import threading


class _Waits(threading.local):
    seconds = 0.0


_waits = _Waits()


def count_wait(seconds: float) -> None:
    """Add seconds to the time that the calling thread has waited for simulators."""
    _waits.seconds += seconds


def waited_s() -> float:
    """Return the seconds that the calling thread has waited for simulators since it began."""
    return _waits.seconds
