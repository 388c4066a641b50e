"""Text tables with aligned columns."""

from collections.abc import Mapping, Sequence
from typing import Any

GAP = "   "
NOTHING = "-"


def lines_of(rows: Sequence[Sequence[str]]) -> list[str]:
    """Return one line per row with aligned columns; the last column is not padded."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return [
        GAP.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    ]


def server_table(table: Mapping[str, Any], *, wide: bool = False, namespaces: bool = False) -> list[str]:
    """Return the lines of an API server's `Table`, with the columns that the CRD defines.

    Args:
        table: the API server's response.
        wide: whether to include the low-priority columns.
        namespaces: whether to add a first column for the namespace.
    """
    shown = [
        place
        for place, column in enumerate(table["columnDefinitions"])
        if wide or not column.get("priority", 0)
    ]
    headings = [table["columnDefinitions"][place]["name"].upper() for place in shown]
    rows = [headings] + [[_cell(row["cells"][place]) for place in shown] for row in table.get("rows") or ()]
    if namespaces:
        spaces = [row["object"]["metadata"]["namespace"] for row in table.get("rows") or ()]
        rows = [[first, *row] for first, row in zip(["NAMESPACE", *spaces], rows, strict=True)]
    return lines_of(rows)


def without_status(table: Mapping[str, Any]) -> list[str]:
    """Return the names of the objects in an API server's `Table` whose column Status is empty."""
    places = [place for place, column in enumerate(table["columnDefinitions"]) if column["name"] == "Status"]
    return [
        row["object"]["metadata"]["name"]
        for row in table.get("rows") or ()
        if any(not row["cells"][place] for place in places)
    ]


def _cell(value: object) -> str:
    return NOTHING if value is None or value == "" else str(value)
