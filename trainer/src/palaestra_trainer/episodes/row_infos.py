"""Split the info of a batched step into the infos of its rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from numpy.typing import NDArray

from palaestra_trainer.environments.infos import OURS, TRUNCATED


def row_infos(info: Mapping[str, Any], rows: int, truncated: NDArray[Any]) -> list[dict[str, Any]]:
    """Return one info for each row, with `valid` True.

    Args:
        info: a dict of arrays with a value for each row, or of dicts of such arrays.
        rows: the number of rows.
        truncated: for each row, whether its episode was truncated and not terminated.
    """
    split = _split({**info, TRUNCATED: truncated}, rows)
    for found in split:
        found[OURS] = {"valid": True}
    return split


def _split(columns: Mapping[str, Any], rows: int) -> list[dict[str, Any]]:
    names = list(columns)
    values = [
        _split(column, rows) if isinstance(column, Mapping) else column.tolist()
        for column in columns.values()
    ]
    if not values:
        return [{} for _ in range(rows)]
    return [dict(zip(names, row, strict=True)) for row in zip(*values, strict=True)]
