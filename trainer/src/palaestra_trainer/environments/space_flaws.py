"""Spaces that every algorithm of Stable-Baselines3 would misread, or does not support."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ConfigurationError

KINDS = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)


def refuse_flaws(seen: spaces.Space[Any], acted: spaces.Space[Any]) -> None:
    """Refuse spaces that every algorithm of Stable-Baselines3 would misread, or does not support.

    Raises:
        ConfigurationError: a space is refused; the message has one line for each reason.
    """
    if lines := [*flaws_of_observation(seen), *flaws_of_action(acted)]:
        raise ConfigurationError("\n".join(lines))


def flaws_of_observation(seen: spaces.Space[Any]) -> Iterator[str]:
    """Yield a line for each part of an observation that would be misread: place, fact and remedy."""
    parts = seen.spaces if isinstance(seen, spaces.Dict) else {"": seen}
    if not parts:
        yield "environment.id: its observation is a Dict without parts; add one"
    for key, part in parts.items():
        what = f"environment.id: its {f'observation {key}'.rstrip()}"
        if not isinstance(part, KINDS):
            yield (
                f"{what} is a {type(part).__name__}, which no policy accepts; use Box, Discrete, "
                "MultiDiscrete or MultiBinary, or a Dict of these"
            )
        elif flaw := _flaw(part):
            yield f"{what} {flaw}"


def flaws_of_action(acted: spaces.Space[Any]) -> Iterator[str]:
    """Yield a line with place, fact and remedy if an action space would be misread."""
    if flaw := _flaw(acted) or _flaw_of_bounds(acted):
        yield f"environment.id: its action {flaw}"


def _flaw(part: spaces.Space[Any]) -> str:
    """Return the reason why Stable-Baselines3 would misread a space, and the remedy; "" if it would not."""
    if isinstance(part, spaces.Discrete | spaces.MultiDiscrete) and np.any(part.start):
        start = np.asarray(part.start).tolist()
        return (
            f"counts from {start}, and networks count from 0; count from 0, and add {start} in the "
            "environment"
        )
    if isinstance(part, spaces.MultiBinary) and len(part.shape) > 1:
        return f"is a MultiBinary of shape {part.shape}; flatten it"
    if isinstance(part, spaces.Box) and not part.shape:
        return "is a single number of shape (); give it the shape (1,)"
    return ""


def _flaw_of_bounds(acted: spaces.Space[Any]) -> str:
    """Return the reason why a Box cannot be an action space, and the remedy; "" if it can."""
    if not isinstance(acted, spaces.Box):
        return ""
    if not np.issubdtype(acted.dtype, np.floating):
        return (
            f"is a Box of {acted.dtype}, but algorithms send fractional values; use float32 or MultiDiscrete"
        )
    if not acted.is_bounded():
        return "has no bounds; give its Box a finite low and high"
    with np.errstate(over="ignore"):
        narrow = np.isfinite(acted.high - acted.low).all()
    return (
        "" if narrow else f"has bounds whose difference is too large for {acted.dtype}; give narrower bounds"
    )
