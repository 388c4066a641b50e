"""Convert values to the expected type; another release may have written the file, or a crash damaged it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from palaestra_protocol.masking import masked

GREATEST = 1e15  # the largest number that a chart shows


def number(value: object) -> float | None:
    """Return a value as a float if a chart can show it; None for other values."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) <= GREATEST and math.isfinite(value) else None


def numbers(value: object) -> tuple[float, ...]:
    """Return the numbers of a list; an empty tuple if any member is not a number."""
    found = tuple(map(number, value)) if isinstance(value, list) else ()
    return tuple(one for one in found if one is not None) if None not in found else ()


def text(value: object) -> str:
    """Return a value as text, with masked passwords in addresses; "" for None."""
    if isinstance(value, list):
        return ", ".join(map(text, value))
    return "" if value is None else masked(str(value))


def record(value: object) -> Mapping[str, Any]:
    """Return a value if it is a JSON object; an empty object for other values."""
    return {str(key): part for key, part in value.items()} if isinstance(value, Mapping) else {}


def records(value: object) -> list[Mapping[str, Any]]:
    """Return the JSON objects in a list, without its other members."""
    return [record(part) for part in value if isinstance(part, Mapping)] if isinstance(value, list) else []


def flat(value: object, path: str = "") -> Iterator[tuple[str, str]]:
    """Yield each value of a nested object with its path, such as `algorithm.name`."""
    if isinstance(value, Mapping) and value:
        for key, part in value.items():
            yield from flat(part, f"{path}.{key}" if path else str(key))
    elif value not in (None, "", [], {}):
        yield path, text(value)


def without_values_of_env(value: Any) -> Any:
    """Return a copy of a job without the values of its containers' variables, which may be secrets."""
    if isinstance(value, Mapping):
        return {
            key: [_without_value(variable) for variable in part]
            if key == "env" and isinstance(part, list)
            else without_values_of_env(part)
            for key, part in value.items()
        }
    return [without_values_of_env(part) for part in value] if isinstance(value, list) else value


def _without_value(variable: Any) -> Any:
    if isinstance(variable, Mapping) and "value" in variable:
        return {**variable, "value": "(left out of the report)"}
    return variable
