"""Functions for the observations of all members: one array, or a dict with an array for each key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

Observations = np.ndarray | dict[str, np.ndarray]


def part(observations: Any, rows: Any) -> Any:
    """Return some rows of observations."""
    return each(observations, lambda column: column[rows])


def each(observations: Any, change: Callable[[Any], Any]) -> Any:
    """Apply `change` to the array of observations, or to each of their arrays; return the results."""
    if isinstance(observations, dict):
        return {key: change(column) for key, column in observations.items()}
    return change(observations)


def stacked(rows: Sequence[Any]) -> Observations:
    """Return single observations as rows of one array, or of one array per key."""
    if rows and isinstance(rows[0], dict):
        return {key: np.array([row[key] for row in rows]) for key in rows[0]}
    return np.array(rows)


def by_name(observations: Any, name: str) -> dict[str, Any]:
    """Return the arrays of observations by name: `name`, or `name/key` for each key of a Dict."""
    if isinstance(observations, dict):
        return {f"{name}/{key}": column for key, column in observations.items()}
    return {name: observations}


def from_names(arrays: Mapping[str, np.ndarray], name: str) -> Observations:
    """Return the observations whose arrays `by_name` returned; `arrays` may contain other arrays too.

    Raises:
        KeyError: the arrays of the observations are missing.
    """
    found = {
        key.removeprefix(f"{name}/"): column for key, column in arrays.items() if key.startswith(f"{name}/")
    }
    return found or arrays[name]


def equal_rows(one: Observations, other: Observations) -> np.ndarray:
    """Return a mask of equal rows, for the row numbers that both arguments have; shape (rows,), bool."""
    pairs = [(column, by_name(other, "")[name]) for name, column in by_name(one, "").items()]
    rows = min(len(column) for pair in pairs for column in pair)
    return np.array(
        [all(np.array_equal(this[row], that[row]) for this, that in pairs) for row in range(rows)], dtype=bool
    )
