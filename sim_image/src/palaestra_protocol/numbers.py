"""Parsers for the numbers of command-line options; each raises `ArgumentTypeError` for an invalid number."""

from __future__ import annotations

import math
from argparse import ArgumentTypeError
from collections.abc import Callable

MOST_PORT = 65535


def whole(least: int = 0, most: int | None = None) -> Callable[[str], int]:
    """Return a parser of whole numbers from `least` to `most`, for argparse's `type`."""

    def read(text: str) -> int:
        try:
            number = int(text)
        except ValueError:
            raise ArgumentTypeError(f"{text!r} is not a whole number") from None
        if number < least or (most is not None and number > most):
            wanted = f"{least} or more" if most is None else f"{least} to {most}"
            raise ArgumentTypeError(f"{number} is refused; give {wanted}")
        return number

    return read


def seconds(text: str) -> float:
    """Return the number of seconds in `text`, finite and above 0; for argparse's `type`."""
    number = _finite(text)
    if number <= 0.0:
        raise ArgumentTypeError(f"{text} is refused; give a number above 0")
    return number


def milliseconds(text: str) -> float:
    """Return the number of milliseconds in `text`, finite and at least 0; for argparse's `type`."""
    number = _finite(text)
    if number < 0.0:
        raise ArgumentTypeError(f"{text} is refused; give 0 or more")
    return number


def _finite(text: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a number") from None
    if not math.isfinite(number):
        raise ArgumentTypeError(f"{text} is refused; give a finite number")
    return number
