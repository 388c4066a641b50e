"""Split the info of a batched step into the infos of its rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.environments.infos import (
    OF_STABLE_BASELINES3,
    OURS,
    TRUNCATED,
    of_environment,
)
from palaestra_trainer.errors import ConfigurationError


def row_infos(info: Mapping[str, Any], rows: int, truncated: NDArray[Any]) -> list[dict[str, Any]]:
    """Return one info for each row, with `valid` True.

    Args:
        info: a dict of arrays with a value for each row, or of dicts of such arrays.
        rows: the number of rows.
        truncated: for each row, whether its episode was truncated and not terminated.

    Raises:
        ConfigurationError: a value is neither an array with a value for each row, nor a dict of such arrays.
    """
    split = _split(info, rows)
    if info.keys() & {*OF_STABLE_BASELINES3, OURS}:
        split = [of_environment(found, valid=True) for found in split]
    for found, cut in zip(split, truncated.tolist(), strict=True):
        found.setdefault(OURS, {"valid": True})
        found[TRUNCATED] = cut
    return split


def _split(columns: Mapping[str, Any], rows: int) -> list[dict[str, Any]]:
    names = list(columns)
    values = [_column(name, column, rows) for name, column in columns.items()]
    if not values:
        return [{} for _ in range(rows)]
    return [dict(zip(names, row, strict=True)) for row in zip(*values, strict=True)]


def _column(name: str, column: Any, rows: int) -> list[Any]:
    if isinstance(column, Mapping):
        return _split(column, rows)
    if isinstance(column, np.ndarray) and column.shape[:1] == (rows,):
        found: list[Any] = column.tolist()
        return found
    shape = f"the shape {column.shape}" if isinstance(column, np.ndarray) else f"a {type(column).__name__}"
    raise ConfigurationError(
        f"environment: the info of the batched step has {shape} in {name!r}; return an array with a value for"
        f" each of the {rows} rows"
    )
